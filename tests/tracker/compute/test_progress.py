from tracker.compute.progress import PartPace, stages


def test_stages_take_equal_parts_of_the_work():
    seen = []
    first, second = stages(lambda stage, share, text="": seen.append((stage, share)), "reading", "fitting")
    first(0.0)
    first(1.0)
    second(0.5)
    assert seen == [("reading", 0.0), ("reading", 0.5), ("fitting", 0.75)]


def test_parts_take_at_most_as_long_as_the_slowest_so_far():
    now = 0.0
    pace = PartPace(lambda: now)
    assert pace.left_s(12) is None
    now = 10.0
    pace.end(2)  # two at the same time
    assert pace.left_s(10) == 50.0
    now = 13.0
    assert pace.left_s(10) == 47.0
    pace.end(1)
    assert pace.left_s(9) == 45.0
