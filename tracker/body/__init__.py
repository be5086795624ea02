"""The articulated body: what it is made of, where a pose puts it, how large it is, which chains are limbs."""
