"""File formats, the project's and foreign ones: one module each, which reads and writes.

Imports `geometry` and `body`; knows no session. Callers use the modules: `anipose`, `model_toml`, `pose_csv`, `trc`,
`joint_maps`.
"""
