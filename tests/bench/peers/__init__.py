"""The benchmark of MBFeat against Mitsuba 3 and Cycles, behind ``./run mbfeat bench``.

| module | holds |
|---|---|
| `scene` | a stage as plain arrays, which every renderer's translation starts from |
| `reader` | USD to that |
| `stages` | which stages there are, made ready for all renderers |
| `rendering` | what a renderer is asked and answers |
| `own`, `mitsuba_scene`, `cycles_scene` | one renderer each, in a process of its own |
| `worker`, `process` | that process, and the measuring side's end of it |
| `errors` | error of an image, and how many samples reach a given one |
| `references` | converged images, kept from run to run |
| `measure`, `report`, `command` | what is measured, how it is shown, and the command |
"""
