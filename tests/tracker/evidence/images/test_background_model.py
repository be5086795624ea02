import numpy as np

from tracker.evidence.images.background_subtraction import (
    background_of_clip,
    background_of_recording,
    subtract_background,
)


def frames(n, noise=0.0, seed=0):
    """Frames of a gray scene of which the right half flickers."""
    rng = np.random.default_rng(seed)
    out = np.full((n, 20, 40, 3), 100.0)
    out[:, :, 20:] += rng.normal(0, noise, (n, 20, 20, 1))
    return out.round().astype(np.uint8)


def test_a_clip_gives_its_mean_and_spread():
    clip = frames(50, noise=8.0)
    model = background_of_clip(iter(clip))
    np.testing.assert_allclose(model.image, clip.mean(axis=0), atol=0.51)
    np.testing.assert_allclose(model.noise, clip.std(axis=0, ddof=1).max(axis=-1), atol=1e-3)


def test_a_single_image_has_no_spread():
    (image,) = frames(1)
    model = background_of_clip([image])
    assert model.noise is None
    assert np.array_equal(model.image, image)
    assert background_of_clip([]) is None


def test_people_who_move_are_not_in_the_background_of_a_recording():
    recording = frames(15)
    for i, frame in enumerate(recording):
        frame[:, 2 * i : 2 * i + 5] = (250, 20, 20)
    model = background_of_recording(recording)
    assert np.all(model.image == 100)
    assert not model.noise.any()


def test_a_pixel_that_flickers_needs_a_larger_difference():
    model = background_of_clip(frames(200, noise=8.0))
    frame = np.full((20, 40, 3), 100, np.uint8)
    frame += np.array([25, 0, 0], np.uint8)
    found = subtract_background(frame, model.image, 12.0, noise=model.noise).inside
    assert found[5:15, 5:15].all()
    assert not found[5:15, 25:35].any()
    assert subtract_background(frame, model.image, 12.0).inside[5:15, 25:35].any()
