"""Files of key points in pictures: one module each.

Imports `geometry` and `body`; knows no session. Callers use `picture_table.PictureTable` and the modules: `openpose`,
`coco`, `deeplabcut`, `sleap_files`.
"""
