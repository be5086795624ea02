from tracker.compute.progress import stages


def test_stages_take_equal_parts_of_the_work():
    seen = []
    first, second = stages(lambda stage, share, text="": seen.append((stage, share)), "reading", "fitting")
    first(0.0)
    first(1.0)
    second(0.5)
    assert seen == [("reading", 0.0), ("reading", 0.5), ("fitting", 0.75)]
