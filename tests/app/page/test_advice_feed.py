"""The line over the views follows the history."""

from gestures import drag

from app.page.feeds.advice import AdviceFeed, stored_work


def test_a_placement_that_is_taken_back_counts_nowhere(controller):
    before = AdviceFeed().updates(controller, controller.state), stored_work(controller)
    drag(controller, "left_wrist", (6.0, -9.0), 0)
    drag(controller, "left_wrist", (5.0, 3.0), 2)
    assert AdviceFeed().updates(controller, controller.state)[0].said[0].situation == "no_depth"
    controller.history.undo()
    controller.history.undo()
    assert (AdviceFeed().updates(controller, controller.state), stored_work(controller)) == before
    assert (controller.state.held, controller.state.people[0].source) == (frozenset(), None)
