/**
 * Layout of the grid of panes. All sizes are CSS pixels.
 *
 * Panes fill tracks in order: rows from top to bottom, or columns from left to right. A *length* is along a track, a *depth*
 * across it; a ratio is length / depth of an image.
 */

/** Gap between neighbours. */
const GAP = 2;
/** Smallest pane that a border can leave. */
const [MIN_WIDTH, MIN_HEIGHT] = [120, 80];
/** Another arrangement must show this much more. Rows are tried before columns, whose order is less usual. */
const GAIN = 1.02;
/** An image counts at most so many times the smallest one: views are compared, so none is large at the cost of the others. */
const MAX_UNEVENNESS = 2;
const ROUNDING = 1e-6;
/** A width other than the usual one must show this much more area, which is a tenth in size: less is not worth another place. */
const WIDER_GAIN = 1.2;
/** Step in which a useful width is looked for, CSS pixels: less is not noticed. */
const WIDTH_STEP = 8;

/**
 * @typedef {{x: number, y: number, width: number, height: number}} Box
 * @typedef {{isColumns: boolean, counts: number[]}} Arrangement counts: panes of each track
 * @typedef {{tracks: number[], panes: number[][]}} Shares of each track in the total depth, and of each pane in the length of
 *   its track; each list sums to 1
 * @typedef {object} Border the gap between two neighbours
 * @property {"tracks" | number} of whether the neighbours are tracks, or else panes of the track of this index
 * @property {number} index of the neighbour before it
 * @property {boolean} isVertical
 * @property {Box} box
 * @property {number[]} sizes of all tracks, or of all panes of the track
 * @property {number} min smallest size of a neighbour
 */

/**
 * Choose the arrangement that shows the largest total area of the images, none much smaller than the others.
 *
 * @param {number[]} aspects width / height of each image
 * @param {number} width
 * @param {number} height
 * @returns {{arrangement: Arrangement, shares: Shares, area: number}}
 */
export function arrange(aspects, width, height) {
  const first = { isColumns: false, counts: [aspects.length] };
  let best = { arrangement: first, ...fit(first, aspects, width, height) };
  for (const isColumns of [false, true]) {
    for (const counts of fillings(isColumns ? aspects.map((aspect) => 1 / aspect) : aspects)) {
      const arrangement = { isColumns, counts };
      const found = fit(arrangement, aspects, width, height);
      if (found.area > GAIN * best.area) best = { arrangement, ...found };
    }
  }
  return best;
}

/**
 * Choose the shares that show the largest total area of the images in a given arrangement.
 *
 * @param {Arrangement} arrangement
 * @param {number[]} aspects width / height of each image
 * @param {number} width
 * @param {number} height
 * @returns {{shares: Shares, area: number}}
 */
export function fit({ isColumns, counts }, aspects, width, height) {
  const [length, depth] = isColumns ? [height, width] : [width, height];
  const tracks = inTracks(isColumns ? aspects.map((aspect) => 1 / aspect) : aspects, counts);
  const [own, equal] = [sharesOf(tracks, length, depth), equalShares(counts)].map((shares) => ({
    shares,
    area: shownArea(tracks, shares, length, depth),
  }));
  return equal.area > GAIN * own.area ? equal : own;
}

/**
 * Width that the images can use: the usual one, or else the smallest at which they are shown about as large as at the
 * largest one.
 *
 * @param {number[]} aspects width / height of each image
 * @param {{usual: number, max: number}} widths
 * @param {number} height
 */
export function usefulWidth(aspects, { usual, max }, height) {
  if (aspects.length === 0) return usual;
  const areaAt = (/** @type {number} */ width) => arrange(aspects, width, height).area;
  const most = areaAt(max);
  if (most < WIDER_GAIN * areaAt(usual)) return usual;
  let width = usual;
  while (width < max && GAIN * areaAt(width) < most) width += WIDTH_STEP;
  return Math.min(width, max);
}

/**
 * Boxes of the panes in whole pixels, and the borders between them.
 *
 * @param {Arrangement} arrangement
 * @param {Shares} shares
 * @param {number} width
 * @param {number} height
 * @returns {{boxes: Box[], borders: Border[]}}
 */
export function layOut({ isColumns }, shares, width, height) {
  const [length, depth] = isColumns ? [height, width] : [width, height];
  const [minLength, minDepth] = isColumns ? [MIN_HEIGHT, MIN_WIDTH] : [MIN_WIDTH, MIN_HEIGHT];
  const tracks = spansOf(shares.tracks, depth);
  /** @type {Box[]} */
  const boxes = [];
  const borders = bordersOf("tracks", tracks, minDepth, (gap) => boxOf({ start: 0, size: length }, gap, isColumns), isColumns);
  tracks.forEach((track, index) => {
    const panes = spansOf(shares.panes[index], length);
    boxes.push(...panes.map((pane) => boxOf(pane, track, isColumns)));
    borders.push(...bordersOf(index, panes, minLength, (gap) => boxOf(gap, track, isColumns), !isColumns));
  });
  return { boxes, borders };
}

/**
 * Shares of the neighbours of a border that is moved.
 *
 * @param {Border} border
 * @param {number} size of the neighbour before it, as far as both keep their smallest size
 */
export function movedShares({ index, sizes, min }, size) {
  const both = sizes[index] + sizes[index + 1];
  // Many panes are smaller than that by themselves.
  const least = Math.min(min, sizes[index], sizes[index + 1]);
  const before = Math.max(least, Math.min(both - least, size));
  const moved = sizes.map((one, at) => (at === index ? before : at === index + 1 ? both - before : one));
  return moved.map((one) => one / sum(moved));
}

/** @typedef {{start: number, size: number}} Span */

/**
 * @param {"tracks" | number} of
 * @param {Span[]} spans
 * @param {number} min
 * @param {(gap: Span) => Box} boxOfGap
 * @param {boolean} isVertical
 * @returns {Border[]}
 */
function bordersOf(of, spans, min, boxOfGap, isVertical) {
  const sizes = spans.map(({ size }) => size);
  return spans.slice(0, -1).map(({ start, size }, index) => {
    return { of, index, isVertical, box: boxOfGap({ start: start + size, size: GAP }), sizes, min };
  });
}

/**
 * @param {Span} along a track
 * @param {Span} across it
 * @param {boolean} isColumn whether the track is a column
 * @returns {Box}
 */
function boxOf(along, across, isColumn) {
  const [horizontal, vertical] = isColumn ? [across, along] : [along, across];
  return { x: horizontal.start, y: vertical.start, width: horizontal.size, height: vertical.size };
}

/**
 * Numbers of panes in each track, for tracks of all lengths and of all numbers of panes that come into question; short
 * tracks first.
 *
 * @param {number[]} ratios
 */
function fillings(ratios) {
  const lengths = ratios.flatMap((_, first) => ratios.slice(first).map((_, more) => sum(ratios.slice(first, first + more + 1))));
  const longest = Math.max(...ratios);
  const byLength = lengths.filter((length) => length >= longest).sort((a, b) => a - b).map((length) => filled(ratios, length)); // prettier-ignore
  const byCount = ratios.map((_, index) => filled(ratios.map(() => 1), index + 1)); // prettier-ignore
  return [...new Map([...byLength, ...byCount].map((counts) => [counts.join(), counts])).values()];
}

/**
 * @param {number[]} ratios
 * @param {number} length of a track, in depths
 */
function filled(ratios, length) {
  const counts = [0];
  let left = length;
  for (const ratio of ratios) {
    if (ratio > left + ROUNDING) {
      counts.push(0);
      left = length;
    }
    counts[counts.length - 1] += 1;
    left -= ratio;
  }
  return counts;
}

/**
 * @param {number[]} ratios
 * @param {number[]} counts
 */
function inTracks(ratios, counts) {
  let first = 0;
  return counts.map((count) => ratios.slice(first, (first += count)));
}

/**
 * Images of a track are equally deep. Tracks are equally deep too, but none deeper than its images can use while others can
 * use more.
 *
 * @param {number[][]} tracks ratios of their images
 * @param {number} length
 * @param {number} depth
 * @returns {Shares}
 */
function sharesOf(tracks, length, depth) {
  const usable = tracks.map((ratios) => length / sum(ratios));
  const depths = tracks.map(() => 0);
  let rest = depth;
  tracks.map((_, index) => index).sort((a, b) => usable[a] - usable[b]).forEach((track, rank) => {
    depths[track] = Math.min(usable[track], rest / (tracks.length - rank));
    rest -= depths[track];
  });
  return {
    tracks: depths.map((one) => (one + rest / tracks.length) / depth),
    panes: tracks.map((ratios) => ratios.map((ratio) => ratio / sum(ratios))),
  };
}

/**
 * @param {number[]} counts
 * @returns {Shares}
 */
function equalShares(counts) {
  return { tracks: counts.map(() => 1 / counts.length), panes: counts.map((count) => Array(count).fill(1 / count)) };
}

/**
 * Total area of the images, as far as it counts.
 *
 * @param {number[][]} tracks ratios of their images
 * @param {Shares} shares
 * @param {number} length
 * @param {number} depth
 */
function shownArea(tracks, shares, length, depth) {
  const areas = tracks.flatMap((ratios, track) =>
    ratios.map((ratio, pane) => {
      return ratio * Math.min(shares.tracks[track] * depth, (shares.panes[track][pane] * length) / ratio) ** 2;
    }),
  );
  const most = MAX_UNEVENNESS * Math.min(...areas);
  return sum(areas.map((area) => Math.min(area, most)));
}

/**
 * Divide a size by shares, with gaps.
 *
 * @param {number[]} shares
 * @param {number} size
 * @returns {Span[]}
 */
function spansOf(shares, size) {
  const free = Math.max(0, size - GAP * (shares.length - 1));
  let before = 0;
  return shares.map((share, index) => {
    const start = Math.round(before * free);
    before += share;
    return { start: start + GAP * index, size: Math.max(1, Math.round(before * free) - start) };
  });
}

/** @param {number[]} values */
function sum(values) {
  return values.reduce((total, value) => total + value, 0);
}
