"""The remedies of the library's errors and warnings, in the words of the command line and of the page.

One entry for each code of a `tracker.errors.Remedy`, with the names of its fields in braces. The command line names
options; the page names its fields and buttons, and no option.
"""

from typing import NamedTuple

from tracker.errors import Remedy, TrackerError


class Phrases(NamedTuple):
    """Ends of a sentence that name the remedy, one for each program."""

    command_line: str
    page: str


PHRASES = {
    # footage and calibration of a new session
    "name_footage": Phrases(
        "rename it, leave it out or say --camera NAME={video}",
        "rename it, leave it out, or give it to a camera in the list of cameras",
    ),
    "give_footage": Phrases(
        "give a file named {camera}.mp4, say --camera {camera}=PATH, or choose other cameras with --cameras",
        "give a file named {camera}.mp4, choose its file in the list of cameras, or leave the camera out",
    ),
    "give_rate": Phrases("give it with --fps RATE", "enter it as Frame rate"),
    "give_common_rate": Phrases(
        "convert the videos to the same rate, or give the rate at which all cameras filmed with --fps {fps}",
        "convert the videos to the same rate, or enter the rate at which all cameras filmed, such as {fps}, as Frame "
        "rate",
    ),
    "give_constant_rate": Phrases(
        "say --fps {fps} if frame k of all cameras is of one instant all the same, else convert it to a constant rate "
        "with frames at the times of the other cameras",
        "enter {fps} as Frame rate if frame k of all cameras is of one instant all the same, else convert it to a "
        "constant rate with frames at the times of the other cameras",
    ),
    "give_frame_offset": Phrases(
        "if they began together, --common-frames takes the {n} frames that all have; else say --offset CAM=N for a "
        "camera that began N frames earlier, or cut them to the same start and end",
        "if they began together, choose Common frames to take the {n} that all have; else enter the offset of a camera "
        "that began earlier, its number of frames, or cut them to the same start and end",
    ),
    "give_image_offset": Phrases(
        "restore it, take those that all have with --common-frames, or say --offset CAM=N for a camera that began N "
        "images earlier",
        "restore it, choose Common frames to take those that all have, or enter the offset of a camera that began "
        "earlier: its number of images",
    ),
    "pair_images": Phrases(
        "rename them so that one number counts, or say --offset CAM=0 to pair them in their order",
        "rename them so that one number counts, or give an offset of 0 to pair them in their order",
    ),
    "give_camera_background": Phrases(
        "add it or leave out --background", "add it, or leave the field Background empty"
    ),
    "give_camera_masks": Phrases("add them or leave out --masks", "add them, or leave the field Masks empty"),
    "give_background": Phrases("give one with --background", "make the session again with a folder of backgrounds"),
    "make_session": Phrases("make one with 'quadrille new'", "choose another folder, or make one with New session…"),
    "rescale": Phrases(
        "say --rescale if it does, and calibrate at the size of the footage if it does not",
        "tick Scale the calibration to the footage if it does, and calibrate at the size of the footage if it does not",
    ),
    "give_unit": Phrases("say --units {units}, or --any-size if the distance is right", "choose {units} as Units"),
    "scale_calibration": Phrases(
        "scale its translations to metres: no --units of {units} gives a studio; say --any-size if the distance is "
        "right",
        "scale its translations to metres: no Units of {units} gives a studio",
    ),
    "any_size": Phrases("say --any-size if it is right", "make the session by the command line if it is right"),
    "give_poses": Phrases(
        "say --poses {poses}, or rewrite them ({rewrite})", "choose {poses} as Poses, or rewrite them ({rewrite})"
    ),
    "name_quaternion": Phrases(
        "name the numbers qw, qx, qy and qz, say --poses if the convention is known, or rewrite them as 3x3 matrices",
        "name the numbers qw, qx, qy and qz, choose Poses if the convention is known, or rewrite them as 3x3 matrices",
    ),
    "keep_rotations": Phrases(
        "say --poses world-to-camera if all cameras are parallel, else give their rotations",
        "choose world-to-camera as Poses if all cameras are parallel, else give their rotations",
    ),
    "choose_poses": Phrases("say which with --poses", "choose one of them as Poses"),
    # files of a session that have moved
    "relink": Phrases(
        "put it back, or run quadrille relink {session} --search FOLDER",
        "put it back, or give its new place on the command line with 'quadrille relink'",
    ),
    "relink_nothing": Phrases("leave out --{kind}", "give no {kind}"),
    "relink_search": Phrases("check the path of --search", "check the path"),
    "relink_which_footage": Phrases(
        "search a smaller folder, or say --camera {camera}=PATH",
        "search a smaller folder, or give the footage of camera '{camera}'",
    ),
    "relink_which_side_files": Phrases(
        "search a smaller folder, or say --{kind} FOLDER", "search a smaller folder, or give the folder of the {kind}"
    ),
    "relink_each": Phrases("give each its own with --camera NAME=PATH", "give each its own"),
    # edits that were kept elsewhere
    "restore": Phrases(
        "end the program and run 'quadrille restore' on the session to write them",
        "end the program and run 'quadrille restore' on the session to write them",
    ),
    "restore_rescue": Phrases(
        "to write them here, end the program and run 'quadrille restore' on the session with --rescue {path}",
        "to write them here, end the program and run 'quadrille restore' on the session with the name of this file",
    ),
    # first poses
    "another_frame": Phrases(
        "choose another --frame, on which {condition}", "go to another frame, on which {condition}"
    ),
    "another_frame_or_place": Phrases(
        "choose another --frame, or place the person in the page", "go to another frame, or place the person by hand"
    ),
    "another_frame_or_background": Phrases(
        "choose another --frame, or check the background", "go to another frame, or check the background"
    ),
    "another_frame_or_camera": Phrases(
        "choose another --frame, or add a camera from another side",
        "go to another frame, or add a camera from another side",
    ),
    "find_otherwise": Phrases(
        "detect the people by a network with quadrille detect, give a --background or masks, or place them in the page",
        "press Detect people, or place them by hand",
    ),
    "name_all_people": Phrases(
        "make the session with all --people, or give masks of the person",
        "make the session with the names of all people, or give masks of the person",
    ),
    "set_keyframes": Phrases(
        "set keyframes in the page, or with init --frame K", "pose the person on two frames and mark them as keyframes"
    ),
    "place_body": Phrases(
        "place the body in the page, or use quadrille init", "place the body by hand, or press Find people"
    ),
    "find_or_place": Phrases(
        "add --init auto to find people, or place the body in the page", "press Find people, or place the body by hand"
    ),
    "common_start": Phrases(
        "clear those of one person, or track without --init and --acquire",
        "clear those of one person, or track from here (T)",
    ),
    "start_beyond": Phrases(
        "choose --frames with that frame, or place the people on one of these",
        "choose frames with that one, or place the people on one of these",
    ),
    # bodies and joints
    "paper_body": Phrases(
        "make a session of it with 'quadrille new --model {body}', or track without --paper",
        "make a session with the body model {body}, or track as usual",
    ),
    "without_paper": Phrases(
        "add poses of such a frame, or leave out --paper", "add poses of such a frame, or acquire as usual"
    ),
    "frame_of_file": Phrases("choose another --frame", "go to a frame of the file"),
    "body_of_table": Phrases(
        "make the session with the --model, a preset or a file, that the poses are of",
        "make a session with the body model that the poses are of",
    ),
    "check_world_of_file": Phrases(
        "check --axes, the units of the file, and that it is in the world of the calibration and of this recording",
        "check the axes and units of the file, and that it is in the world of the calibration and of this recording",
    ),
    "read_as_skeleton": Phrases(
        "say --joint-map {name}, or --unusual to keep them as they are",
        "enter {name} as Names of points, or tick Keep unusual points",
    ),
    "exchange_sides": Phrases(
        "exchange left and right in a --joint-map FILE.toml, or say --unusual to keep them as they are",
        "export them again with left and right exchanged, or tick Keep unusual points",
    ),
    "read_in_unit": Phrases(
        "correct the unit, by --units in a file that states none, or say --unusual to keep them as they are",
        "correct the unit, by Units for a file that states none, or tick Keep unusual points",
    ),
    "read_with_axes": Phrases(
        "say --axes={axes}, or --unusual to keep them as they are", "enter {axes} as Axes, or tick Keep unusual points"
    ),
    "shift_points": Phrases(
        "say --first-frame={frame}, or --unusual to keep them as they are",
        "enter {frame} as First frame, or tick Keep unusual points",
    ),
    "check_points": Phrases(
        "check the names of the points with --joint-map, and the unit, or say --unusual to keep them as they are",
        "check the names of the points and the unit, or tick Keep unusual points",
    ),
    "check_joint_map": Phrases("check --joint-map", "check which joint each marker stands for"),
    "give_joint_map": Phrases(
        "give a --joint-map FILE.toml with a line such as left_shoulder = {marker} for each joint "
        "(docs/recordings.md has an example)",
        "rename the markers as one of these conventions does",
    ),
    "name_observed_camera": Phrases(
        "rename it after its camera, leave it out, or say --cameras {camera}=PATH",
        "rename it after its camera, or leave it out",
    ),
    "give_point_order": Phrases(
        "give a --joint-map FILE.toml whose 'points' lists the names of the {n} points in order, or the name of a "
        "known one (docs/observations.md has an example)",
        "list the names of the points in a joint map",
    ),
    "place_first_picture": Phrases(
        "if they are of this footage, say --first-frame N with the frame of the session that the lowest number shows",
        "choose the frame of the session that the lowest number shows",
    ),
    "export_at_rate": Phrases(
        "export it again at {fps} per second, or say --first-frame N if each picture is a frame of the session",
        "export it again at {fps} per second",
    ),
    "scale_normalized": Phrases("say --picture-size 1x1 to scale them", "export them in pixels"),
    "give_picture_size": Phrases(
        "export them from this footage, or say --picture-size {size} if it shows the same, to scale them",
        "export them from this footage",
    ),
    "say_confidence": Phrases(
        "export them with it, or say --confidence 1 to trust all points alike", "export them with a confidence"
    ),
    "check_views": Phrases(
        "check that each folder is of the camera that it is named after, the size of the pictures, and --first-frame",
        "check that each folder is of the camera that it is named after, and the size of the pictures",
    ),
    "shift_keypoints": Phrases(
        "say --offset {camera}={frames} to take that off, or {camera}=0 to keep them if the footage is itself late",
        "enter {camera}={frames} as Offsets to take that off, or {camera}=0 to keep them if the footage is itself late",
    ),
    "say_unit": Phrases("say --units m, cm, mm, in or ft", "choose the unit"),
    "install_import": Phrases(
        "install it with: pip install 'quadrille[import]'", "install it with: pip install quadrille[import]"
    ),
    "export_joints": Phrases("export poses with --format", "export poses in another format"),
    "get_models": Phrases(
        "fetch it with quadrille detect --get-models, or name its folder to quadrille detect with --models FOLDER",
        "fetch the networks on the command line, as docs/observations.md describes",
    ),
    "name_people_of_files": Phrases("name them with --person", "give one file for each person"),
    "count_frames": Phrases("say --clock frames", "correct Time in the file"),
    "choose_clock": Phrases(
        "say --clock frames if each Frame# is one frame of the session (at {fps} per second), or --clock time if the "
        "rows lie at their Time",
        "correct DataRate or Time in the file (the session has {fps} frames per second)",
    ),
    "choose_first_frame": Phrases(
        "say --first-frame {frames}", "correct Frame#, Time or OrigDataStartFrame in the file"
    ),
    # cameras that are off
    "acquire_first": Phrases(
        "say --acquire to acquire it for the check", "press Check the cameras again to acquire it for the check"
    ),
    "check_cameras": Phrases(
        "run quadrille check to measure it", "press Check the cameras in the inspector's Calibration to measure it"
    ),
    # a batch
    "do_again": Phrases("say --retry to do it again", "do it again on the command line"),
    # references and exports
    "check_reference_frames": Phrases(
        "check --frames, --person and the reference's frame numbers",
        "check the frames, the person and the reference's frame numbers",
    ),
    "turn_axis": Phrases("turn one sign of --axes, e.g. x,-z,y", "turn the sign of one axis, e.g. x,-z,y"),
    "name_axes": Phrases("correct --axes", "correct the axes"),
    "reference_axes": Phrases(
        "with --axes {axes} it would be {distance_m:.2f} m", "with the axes {axes} it would be {distance_m:.2f} m"
    ),
    "reference_units": Phrases("correct the Units of the file", "correct the Units of the file"),
    "align_reference": Phrases("say --align rigid-all", "align it rigidly"),
    "check_reference": Phrases(
        "check that it is of this recording and person, --axes, and the units",
        "check that it is of this recording and person, its axes, and its units",
    ),
    "frames_of_one_body": Phrases(
        "give frames of one body as --frames, or another format", "choose Frames of one body, or another format"
    ),
    "export_all_poses": Phrases(
        "leave out --keyframes-only and --reviewed-only, or review poses first",
        "choose all poses, or review poses first",
    ),
    "export_images": Phrases("leave out --pictures video, or --pixels", "choose Images, or Pixels as filmed"),
    "fewer_people": Phrases("export one --person at a time", "export one of People at a time"),
    "fewer_frames": Phrases("choose fewer as --frames, or another format", "choose fewer Frames, or another format"),
    "name_format": Phrases("correct --format", "choose another format"),
    "export_other_format": Phrases(
        "export the poses with --format instead, or leave them unedited to get the files as they came",
        "export the poses in another format",
    ),
    "another_file": Phrases("choose another --out", "choose another file"),
    "another_file_or_overwrite": Phrases("choose another --out, or add --overwrite", "choose another file"),
}
"""Phrases by code."""


def command_line_text(text: object, remedy: Remedy | None = None) -> str:
    """Return an error, or a warning with its remedy, in the words of the command line."""
    return _sentence(text, remedy, 0)


def page_text(text: object, remedy: Remedy | None = None) -> str:
    """Return an error, or a warning with its remedy, in the words of the page."""
    return _sentence(text, remedy, 1)


def page_sentence(text: object) -> str:
    """Return an error as a sentence of the page; empty if there is none."""
    words = page_text(text)
    return f"{words[:1].upper()}{words[1:]}." if words else ""


def _sentence(text: object, remedy: Remedy | None, column: int) -> str:
    if isinstance(text, TrackerError):
        remedy = remedy or text.remedy
    if remedy is None:
        return str(text)
    return f"{text}; {PHRASES[remedy.code][column].format(**remedy.fields)}"
