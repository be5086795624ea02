"""What other programs say of a recording, and what is sent to them.

Key points, joints and masks come in, are matched and checked, and are stored beside the session; stored poses go out.
The wing may import those up to `estimation`. It writes no pose.
"""
