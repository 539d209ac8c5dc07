"""How time and memory grow with the work, behind ``./run mbfeat bench --growth``.

| module | holds |
|---|---|
| `axes` | what grows, over which values, and how each is rendered |
| `stages` | the procedural stages |
| `worker` | the process that renders one value |
| `interactive` | the process that times the first pixel and camera moves of a viewer |
| `measure` | rounds of such processes, each answer kept, so that a killed run goes on |
| `fits` | medians, slopes, cost per decade, fixed cost, speed-up |
| `report`, `charts`, `page` | tables, plots, and the page of the documentation |
| `command` | the command |
"""
