/** Layout of the grid of panes. All sizes are CSS pixels. */

/** Gap between neighbours. */
const GAP = 2;

/** @typedef {{x: number, y: number, width: number, height: number}} Box */

/**
 * Lay out images in rows of equal height, as large as the space allows. Widths are proportional to aspect ratios. An
 * incomplete row is centred.
 *
 * @param {number[]} aspects width / height of each image
 * @param {number} width
 * @param {number} height
 * @returns {Box[]}
 */
export function layOut(aspects, width, height) {
  let best = { size: -1, rows: /** @type {number[][]} */ ([]) };
  for (let count = 1; count <= aspects.length; count += 1) {
    const rows = inRows(aspects, count);
    const size = Math.min(height / rows.length, width / widest(rows));
    if (size > best.size) best = { size, rows };
  }
  const { rows } = best;
  const perAspect = Math.min(...rows.map((row) => (width - GAP * (row.length - 1)) / sum(row)));
  const rowHeight = Math.floor((height - GAP * (rows.length - 1)) / rows.length);
  return rows.flatMap((row, index) => {
    const widths = row.map((aspect) => Math.max(1, Math.floor(aspect * perAspect)));
    let x = Math.max(0, Math.floor((width - sum(widths) - GAP * (row.length - 1)) / 2));
    return widths.map((paneWidth) => {
      const box = { x, y: index * (rowHeight + GAP), width: paneWidth, height: Math.max(1, rowHeight) };
      x += paneWidth + GAP;
      return box;
    });
  });
}

/**
 * Fill rows in order, each with the fewest images that the number of rows allows. Equal images then align in columns.
 *
 * @param {number[]} aspects
 * @param {number} count
 */
function inRows(aspects, count) {
  const perRow = Math.ceil(aspects.length / count);
  const rows = [];
  for (let first = 0; first < aspects.length; first += perRow) rows.push(aspects.slice(first, first + perRow));
  return rows;
}

/** @param {number[][]} rows */
function widest(rows) {
  return Math.max(...rows.map(sum));
}

/** @param {number[]} values */
function sum(values) {
  return values.reduce((total, value) => total + value, 0);
}
