"""Which curves a page receives."""

from app.page.feeds.curves import CurveFeed


def test_curves_come_once_and_not_when_they_were_put_away_meanwhile(opened):
    controller, feed = opened(), CurveFeed()
    state = controller.state
    assert not feed.is_due(state)
    feed.show("arms")
    assert feed.is_due(state)
    assert feed.updates(controller, state)
    assert not feed.is_due(state)
    feed.show("legs")
    assert feed.is_due(state)
    feed.show(None)  # while the worker begins
    assert feed.updates(controller, state) == []
    assert not feed.is_due(state)
