"""The generation of the scenes, apart from their code so that reading a data set needs no USD."""

# Changes whenever a stage of the same class, seed and number would come out different.
VERSION = 1
