"""Frame k of every camera, bit-identical however it is reached: decoding, packet lists, proxies, backgrounds and
masks."""
