"""Seeded procedural USD stages, dominated by what first-hit features cannot see.

`catalogue` names the scene classes and their shares; each class is a function of a `Builder`, which
holds the stage, its random numbers and the families of meshes and textures it may draw from.
"""
