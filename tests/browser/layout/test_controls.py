"""All controls can be seen and pressed in windows of every size."""

import pytest
from page_driver import command, shows

AMISS = """() => {
  const name = (e) => e.id || e.ariaLabel || e.textContent;
  const all = document.querySelectorAll("button, input, select, summary, .person-name, .doubt-text *, #timeline");
  return [...all].filter((e) => e.checkVisibility({ opacityProperty: true })).flatMap((e) => {
    const box = e.getBoundingClientRect();
    let clip = e.parentElement;
    while (clip && getComputedStyle(clip).overflow === "visible") clip = clip.parentElement;
    const { left, top, right, bottom } = clip?.getBoundingClientRect() ?? new DOMRect(0, 0, innerWidth, innerHeight);
    const isBelow = box.bottom > bottom + 1 || box.top < top - 1;
    if (box.width < 4 || (isBelow && getComputedStyle(clip ?? e).overflowY === "auto")) return [];  // it is scrolled to
    if (isBelow || box.right > right + 1 || box.left < left - 1) return [`${name(e)} outside`];
    if (e.matches(".number-field, .person-name") && e.scrollWidth > e.clientWidth + 1) return [`${name(e)} cut`];
    const at = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);
    const isCovered = at && !at.contains(e) && !e.contains(at) && !at.closest(":popover-open, .pane");
    return isCovered && !at.closest("#inspector") ? [`${name(e)} under ${name(at)}`] : [];
  });
}"""
SIZES = [(1100, 680), (1280, 720), (1024, 576), (1024, 768), (1410, 700), (1500, 700), (1600, 700), (1920, 1080)]
"""Sizes of windows, CSS px; 1024x576 is 1280x720 at 125%."""


@pytest.mark.slow
@pytest.mark.parametrize("endpoint", [{}, {"n_people": 2}, {"n_people": 2, "n_guests": 6}], indirect=True)
async def test_no_control_is_cut_off_or_covered_in_windows_of_any_size(page, endpoint):
    endpoint.state |= {"dofs": [-143.4] * len(endpoint.state["dofs"]), "saved": False, "save_error": "full"}
    await endpoint.broadcast(endpoint.state)
    await shows(page, "document.querySelector('#saved').textContent === 'Not saved'")
    for width, height in SIZES:
        await page.set_viewport_size({"width": width, "height": height})
        least = {1100: 0.46, 1280: 0.5}.get(width, 0.0) if endpoint.n_people == 1 else 0.0  # of the views
        await shows(page, f"document.body.scrollWidth === {width} && quadrille.state.views[0].scale > {least}")
        for opened in ("Inspector: sizes, settings (toggle)", "Doubtful and lost poses, most severe first"):
            await command(page, opened)
            await shows(page, "true")
            assert await page.evaluate(AMISS) == [], (width, height, opened)
            await command(page, opened)
