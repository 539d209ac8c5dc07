"""What ``./run`` is made of: the set-up steps, the environment, and the project's own commands.

Standard library only, so that it runs before anything is installed.
"""
