import numpy as np
import pytest

from tracker.errors import FormatError
from tracker.formats.trc import read_trc, write_trc

HEADER = (
    "PathFileType\t4\t(X/Y/Z)\tx.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
    "50\t50\t2\t2\t{units}\t50\t1\t2\n"
    "Frame#\tTime\tKnee\t\t\tHeel\t\t\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n"
)


@pytest.fixture
def write(tmp_path):
    def _write(rows, units="m", header=HEADER):
        path = tmp_path / "x.trc"
        path.write_text(header.format(units=units) + rows)
        return path

    return _write


def test_rows_frames_and_blanks(write):
    table = read_trc(write("\n7\t0.12\t1\t2\t3\t4\t5\t6\n9\t0.16\t1.5\t\t3\t\t\t\n"))
    assert table.names == ("Knee", "Heel")
    assert table.frames.tolist() == [7, 9]
    assert table.origin == 1
    assert table.times.tolist() == [0.12, 0.16]
    assert table.rate == 50
    np.testing.assert_array_equal(table.points[0], [[1, 2, 3], [4, 5, 6]])
    assert np.isnan(table.points[1]).all()  # a point with one coordinate missing is missing


@pytest.mark.parametrize(
    "row", ["1\t0\t1\t2\t3", "1\t0\t1\t2\t3\t\t\t\t\t", "1\t0\t1\t2\t3\tNaN\tnan\t ", "1\t0\t1\t2\t3\t\t\t\n\n"]
)
def test_ways_to_leave_a_point_out(write, row):
    points = read_trc(write(row + "\n")).points
    assert points[0, 0].tolist() == [1, 2, 3]
    assert np.isnan(points[0, 1]).all()


@pytest.mark.parametrize(
    "word",
    ["NaN", "nan", "-nan", "N/A", "#N/A", "null", "None", "-", "--", "1.#QNAN", "-1.#IND", "1.#IND", "-nan(ind)"],
)
def test_words_for_a_missing_value(write, word):
    points = read_trc(write(f"1\t0\t1\t2\t3\t{word}\t {word} \t{word}\n")).points
    assert points[0, 0].tolist() == [1, 2, 3]
    assert np.isnan(points[0, 1]).all()
    with pytest.raises(FormatError, match="line 6, column 2: expected a finite number"):
        read_trc(write(f"1\t{word}\t1\t2\t3\t4\t5\t6\n"))


def test_decimal_commas_are_named(write):
    with pytest.raises(FormatError, match=r"line 6: expected a point in decimal numbers, found a comma in '0,033'"):
        read_trc(write("1\t0,033\t1,5\t2\t3\t4\t5\t6\n"))
    with pytest.raises(FormatError, match=r"line 3, DataRate: expected a point in decimal numbers.*'29,97'"):
        read_trc(write(ROW, header=HEADER.replace("\n50\t50", "\n29,97\t29,97", 1)))


@pytest.mark.parametrize("after", range(1, 6))
@pytest.mark.parametrize("blank", ["\n", "\n\n", "\t\t\n", "\r\n"])
def test_blank_lines_in_the_header(write, after, blank):
    lines = HEADER.splitlines(keepends=True)
    table = read_trc(write(ROW, header="".join([*lines[:after], blank, *lines[after:]])))
    assert (table.names, table.rate, table.frames.tolist()) == (("Knee", "Heel"), 50, [1])


def test_a_blank_line_in_place_of_the_axes(write):
    table = read_trc(write(ROW + "2\t0.02\t1\t2\t3\n", header="".join(HEADER.splitlines(keepends=True)[:4]) + "\n"))
    assert table.frames.tolist() == [1, 2]


@pytest.mark.parametrize(
    ("rows", "n_frames", "found"),
    [
        ("1\t0\t1\t2\t3\t4\t5\t6\n2\t0.02\t1\t2\t3\t4.1", 2, "line 7: .*6 of 8 columns in row 2 of 2"),
        ("1\t0\t1\t2\t3\t4\t5\t6\n2\t0.02\t1\t2\t3", 2, "5 of 8 columns in row 2 of 2"),
        ("1\t0\t1\t2\t3\t4\t5\t6\n2\t0.02\t1\t2\t3\t4\t5\t6", 9, "8 of 8 columns in row 2 of 9"),
        ("1\t0\t1\t2\t3\t4\t5\t6\n2", 9, "1 of 8 columns in row 2 of 9"),
    ],
)
def test_a_file_that_was_cut_off(write, rows, n_frames, found):
    header = HEADER.replace("50\t50\t2\t", f"50\t50\t{n_frames}\t")
    with pytest.raises(FormatError, match=f"expected the end of a line.*{found}|{found}.*cut off"):
        read_trc(write(rows, header=header))
    complete = "\n".join(rows.split("\n")[:1]) + "\n"
    assert read_trc(write(complete, header=header)).frames.tolist() == [1]


def test_rows_that_the_header_promises_are_missed(write):
    (note,) = read_trc(write(ROW)).notes
    assert "promises 2 rows, and it has 1" in note
    assert read_trc(write(ROW + "2\t0.02\t1\t2\t3\t4\t5\t6\n")).notes == ()


def test_points_at_zero_are_missing(write):
    table = read_trc(write("1\t0\t0\t0\t0\t4\t5\t6\n2\t0.02\t0\t0\t1\t0.0\t-0.0\t0\n"))
    assert np.isnan(table.points[:, :, 0]).tolist() == [[True, False], [False, True]]
    assert table.notes == ("2 of its points lie at 0, 0, 0 exactly, as missing ones: they are left out",)


def test_a_last_line_without_an_end_is_read_where_it_is_complete(write):
    assert read_trc(write(ROW + "2\t0.02\t1\t2\t3\t4\t5\t6")).frames.tolist() == [1, 2]


@pytest.mark.parametrize(("units", "metres"), [
    ("m", 1.0), ("meter", 1.0), ("meters", 1.0), ("Metres", 1.0), ("mm", 0.001), ("MM", 0.001), ("millimeters", 0.001),
    ("millimetre", 0.001), ("cm", 0.01), ("centimeters", 0.01), ("centimetre", 0.01), ("in", 0.0254), ("inch", 0.0254),
    ("Inches", 0.0254), ("ft", 0.3048), ("feet", 0.3048),
])  # fmt: skip
def test_units(write, units, metres):
    assert read_trc(write("1\t0\t1\t2\t3\t4\t5\t6\n", units)).points[0, 1] == pytest.approx(
        np.array([4, 5, 6]) * metres
    )


@pytest.mark.parametrize("units", ["m", "mm"])
def test_round_trip(tmp_path, units):
    rng = np.random.default_rng(2)
    points = rng.normal(0, 2, (6, 3, 3))
    points[2, 1] = np.nan
    frames = [0, 1, 2, 5, 6, 9]
    write_trc(tmp_path / "a.trc", ["a b", "c", "d"], points, 59.94, frames=frames, units=units)
    back = read_trc(tmp_path / "a.trc")
    assert back.names == ("a b", "c", "d")
    assert (back.frames - 1).tolist() == frames
    assert back.origin == 1
    assert back.rate == 59.94
    np.testing.assert_allclose(back.points, points, atol=1e-7)
    np.testing.assert_allclose(back.times, np.array(frames) / 59.94, atol=1e-6)


def test_frame_numbers_in_the_file_begin_at_one(tmp_path):
    write_trc(tmp_path / "a.trc", ["a"], np.ones((2, 1, 3)), 25)
    rows = (tmp_path / "a.trc").read_text().splitlines()[6:]
    assert [r.split("\t")[:3] for r in rows] == [["1", "0.000000", "1.0000000"], ["2", "0.040000", "1.0000000"]]


def test_first_frame_is_kept_by_number_time_and_origin(tmp_path):
    write_trc(tmp_path / "a.trc", ["a"], np.ones((2, 1, 3)), 25, frames=[40, 41])
    back = read_trc(tmp_path / "a.trc")
    assert (back.frames.tolist(), back.times.tolist(), back.origin) == ([41, 42], [1.6, 1.64], 41)
    assert np.isfinite(back.points).all()


@pytest.mark.parametrize(
    ("text", "origin"), [("1", 1), ("0", 0), ("20.0", 20), ("", None), ("x", None), ("1e300", None)]
)
def test_original_start_frame(write, text, origin):
    header = HEADER.replace("\t50\t1\t2\n", f"\t50\t{text}\t2\n")
    assert read_trc(write("1\t0\t1\t2\t3\t4\t5\t6\n", header=header)).origin == origin


@pytest.mark.parametrize(
    ("rows", "units", "expected"),
    [
        ("1\t0\t1\t2\t3\t4\t5\t6\t7\n", "m", "line 6: expected 8 columns, found 9"),
        ("1\t0\t1\t2\t3\t4\t5\t6\n2\t0.1\tx\n", "m", "line 7: expected numbers.*'x'"),
        ("\t0\t1\t2\t3\t4\t5\t6\n", "m", "line 6"),
        ("1.5\t0\t1\t2\t3\t4\t5\t6\n", "m", "line 6"),
        ("2\t0\t1\n1\t0\t1\n", "m", "line 7: expected frame numbers that rise"),
        ("1e300\t0\t1\n", "m", "line 6: expected a whole frame number of at most 10000000 first, found 1e\\+300"),
        ("nan\t0\t1\n", "m", "line 6: expected a whole frame number"),
        ("1\n", "m", "line 6: expected 8 columns, found 1"),
        ("1\tinf\t1\n", "m", "line 6, column 2: expected a finite number"),
        ("1\t0\t1\t2\t3\n2\t0\t1\tinf\t3\n", "m", "line 7, column 4: expected a finite number .*found inf"),
        ("", "m", "no rows"),
        ("1\t0\t1\t2\t3\t4\t5\t6\n", "ells", "line 3: expected Units.*'ells'"),
    ],
)
def test_malformed(write, rows, units, expected):
    with pytest.raises(FormatError, match=expected):
        read_trc(write(rows, units))


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("Heel", "Knee", "line 4: expected 1 to 2000 point names, each once"),
        ("50\t50\t2", "fast\t50\t2", "line 3, DataRate: expected a frame rate above 0.*found 'fast'"),
        ("50\t50\t2", "1e-300\t50\t2", "line 3, DataRate"),
        ("50\t50\t2", "inf\t50\t2", "line 3, DataRate"),
        ("Knee", "\t\t\t".join(f"p{i}" for i in range(2001)), "line 4: expected 1 to 2000 point names"),
        ("PathFileType", "Path", "not a TRC file"),
        ("Frame#\tTime\tKnee\t\t\tHeel\t\t", "Frame# Time Knee Heel", "line 4: expected columns separated by tabs"),
    ],
)
def test_malformed_header(write, old, new, expected):
    with pytest.raises(FormatError, match=expected):
        read_trc(write("1\t0\t1\t2\t3\t4\t5\t6\n", header=HEADER.replace(old, new, 1)))


def test_few_short_rows_of_many_points_are_refused_before_they_fill_the_memory(write, monkeypatch):
    monkeypatch.setattr("tracker.formats.number_rows.MAX_VALUES", 10_000)
    names = "\t\t\t".join(f"p{i}" for i in range(1000))
    with pytest.raises(FormatError, match="line 9: expected at most 10000 values, found more"):
        read_trc(write("".join(f"{k}\t0\n" for k in range(9)), header=HEADER.replace("Knee\t\t\tHeel", names)))


ROW = "1\t0\t1\t2\t3\t4\t5\t6\n"


@pytest.mark.parametrize("encoding", ["latin-1", "cp1252", "utf-16", "utf-8-sig"])
def test_the_path_in_the_first_line_may_be_of_any_encoding(tmp_path, encoding):
    text = HEADER.replace("x.trc", "C:\\Users\\José\\é.trc", 1).format(units="m") + ROW
    (tmp_path / "a.trc").write_bytes(text.encode(encoding))
    table = read_trc(tmp_path / "a.trc")
    assert (table.names, table.points[0, 1].tolist()) == (("Knee", "Heel"), [4.0, 5.0, 6.0])


def test_names_of_another_encoding_are_refused(tmp_path):
    text = HEADER.replace("Knee", "Knöchel", 1).format(units="m") + ROW
    (tmp_path / "a.trc").write_bytes(text.encode("latin-1"))
    with pytest.raises(FormatError, match=r"a\.trc, line 4: expected UTF-8 text in names.*Kn.*save the file as UTF-8"):
        read_trc(tmp_path / "a.trc")
    (tmp_path / "a.trc").write_bytes(text.encode("utf-16"))
    assert read_trc(tmp_path / "a.trc").names == ("Knöchel", "Heel")


def test_missing(tmp_path):
    with pytest.raises(FormatError, match="not found"):
        read_trc(tmp_path / "none.trc")


@pytest.mark.parametrize(
    ("name", "n_frames", "n_points"),
    [("walk/ground_truth.trc", 60, 32), ("balance_real/reference_joints.trc", 100, 25)],
)
def test_footage_at_hand(data_folder, name, n_frames, n_points):
    folder, file = name.split("/")
    table = read_trc(data_folder(folder) / file)
    assert table.frames.tolist() == list(range(1, n_frames + 1))
    assert len(table.names) == n_points
    heights = table.points[..., 2]
    assert -0.1 < np.nanmin(heights) < np.nanmax(heights) < 2.0


def test_headers_with_spaces_and_without_axes(tmp_path):
    path = tmp_path / "a.trc"
    write_trc(path, ["a"], np.ones((3, 1, 3)), 30.0)
    text = path.read_text()
    path.write_text(text.replace("DataRate\tCameraRate", " datarate \tCameraRate").replace("Units", "UNITS "))
    assert read_trc(path).rate == 30.0
    lines = text.splitlines()
    path.write_text("\n".join(lines[:4] + lines[6:]))
    with pytest.raises(FormatError, match="line 5: expected X1, Y1, Z1"):
        read_trc(path)
