"""Results of other programs about a recording, and results for them.

Key points, joints and masks come in, are matched and checked, and are stored beside the session; stored poses go out.
The wing may import those up to `estimation`. It writes no pose.
"""
