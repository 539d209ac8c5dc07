"""Comparison of ways to reconstruct an image from its samples.

| module | does |
|---|---|
| `methods` | the raw mean, our networks, Open Image Denoise |
| `oidn` | Open Image Denoise through pyoidn, where that is installed |
| `auxiliary` | first-hit and first non-delta features of a pixel |
| `data` | the windows to compare on, rendered again from seeds where they are missing |
| `statistics` | means by group, ratios and bootstrap intervals |
| `report` | the table, JSON, and the sheet of crops |
"""
