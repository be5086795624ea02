import numpy as np
import pytest

from tracker.evidence.images.background_subtraction import clean_silhouette


def person(size=(480, 640)):
    mask = np.zeros(size, bool)
    mask[100:400, 250:350] = True
    return mask


def test_a_clean_silhouette_stays():
    cleaned = clean_silhouette(person())
    assert np.array_equal(cleaned.mask, person())
    assert cleaned.quality == 1.0


def test_specks_and_small_holes_go_and_lower_the_quality():
    changed = person()
    changed[10:14, 10:14] = True
    changed[200:212, 290:300] = False
    changed[250, 250:350] = False  # a body that is cut in two by a thin line
    cleaned = clean_silhouette(changed)
    assert np.array_equal(cleaned.mask, person())
    assert 0.95 < cleaned.quality < 1.0


def test_a_gap_between_arm_and_trunk_stays_open():
    changed = person()
    changed[150:300, 280:300] = False
    # Closing rounds the corners of the gap.
    assert np.count_nonzero(clean_silhouette(changed).mask ^ changed) < 20


def test_two_people_stay():
    changed = person()
    changed[200:400, 500:540] = True
    assert np.array_equal(clean_silhouette(changed).mask, changed)


@pytest.mark.parametrize("specks", [0, 40])
def test_nobody(specks):
    changed = np.zeros((480, 640), bool)
    changed[: 10 * specks : 10, 5] = True
    cleaned = clean_silhouette(changed)
    assert not cleaned.mask.any()
    assert cleaned.quality == 0.0


def test_the_quality_falls_with_noise():
    rng = np.random.default_rng(0)
    changed = [person() ^ (rng.random((480, 640)) < p) for p in (0.0, 0.02, 0.05)]
    qualities = [clean_silhouette(c).quality for c in changed]
    assert sorted(qualities, reverse=True) == qualities
    assert qualities[-1] < 0.9
