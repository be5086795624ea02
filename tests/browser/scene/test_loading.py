"""When the 3-D view is loaded."""

import pytest
from page_driver import OPENED, reloaded, shows

ADDRESS = "document.querySelector('#scene').getAttribute('src')"


@pytest.mark.slow
async def test_it_follows_the_first_cost_where_no_graphics_card_draws(page, endpoint):
    """Its start stops such a page for seconds, in which nobody could drag."""
    endpoint.state |= {"compiling": "evidence", "cost_px": None}
    await reloaded(page)
    assert await page.evaluate(ADDRESS) is None
    await endpoint.tell(cost_px=6.27)
    await shows(page, f"{ADDRESS}?.startsWith('viser/')")


@pytest.mark.slow
async def test_it_waits_no_longer_than_for_the_kernels_of_a_cost(page, endpoint):
    """A frame that cannot be read has no cost."""
    endpoint.state |= {"compiling": "tracking", "cost_px": None}
    await reloaded(page, f"{OPENED} && {ADDRESS}?.startsWith('viser/')")
