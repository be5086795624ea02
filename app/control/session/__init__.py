"""The session's state under its lock, and what all parts of the controller share.

Other rooms of `app.control` use `session_state.SessionState` and `activities.Activities`. The parts `history`,
`stored_poses`, `footage_scan` and `kernel_warmup` are used through the controller.
"""
