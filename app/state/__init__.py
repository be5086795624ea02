"""The state of an open session as frozen values: all that the views need.

May import `tracker`. Callers use `state.State`; its parts are in `people`, `search`, `progress`, `view_3d` and
`floor_picking`. `page_view` holds the choices of one page.
"""
