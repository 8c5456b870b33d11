"""Reads an evaluated Blender scene into the dataclasses of `vlp_bpt`: one module for each kind of datablock."""
