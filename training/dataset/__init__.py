"""Data sets of path samples and references, rendered through Hydra into sharded files.

| module | does |
|---|---|
| `layout` | names the stored channels and their types |
| `rendering` | renders a window of a stage: samples, references, a preview |
| `windows` | chooses where to look |
| `items` | makes one item of a data set from its number alone |
| `shards` | stores items so that any run can resume, verify and stream them |
| `plan` | what a data set holds, as a small file beside its shards |
| `reader` | the shards as one sequence of memory-mapped arrays |
"""
