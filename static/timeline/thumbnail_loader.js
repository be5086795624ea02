/** Load thumbnails one after the other while they are visible, so that they delay neither the page nor the program. */

const AT_ONCE = 2;
/** The program makes no thumbnails while it compiles or when too many wait. */
const RETRY_MS = 3000;

/** @param {HTMLElement} scroller contains the images */
export function makeThumbnailLoader(scroller) {
  /** @type {Set<HTMLImageElement>} visible images that wait for their turn */
  const waiting = new Set();
  let loading = 0;
  const observer = new IntersectionObserver(
    (entries) => {
      for (const { target, isIntersecting } of entries) {
        const image = /** @type {HTMLImageElement} */ (target);
        if (isIntersecting && !image.src) waiting.add(image);
        else waiting.delete(image);
      }
      next();
    },
    { root: scroller, rootMargin: "80px" },
  );

  /**
   * Load an image when it becomes visible.
   *
   * @param {HTMLImageElement} image
   * @param {string} url
   */
  function watch(image, url) {
    image.dataset.url = url;
    observer.observe(image);
  }

  /** @param {HTMLImageElement} image that was removed */
  function forget(image) {
    observer.unobserve(image);
    waiting.delete(image);
  }

  function next() {
    for (const image of waiting) {
      if (loading >= AT_ONCE) return;
      waiting.delete(image);
      loading += 1;
      const done = () => {
        loading -= 1;
        next();
      };
      image.onload = done;
      image.onerror = () => {
        image.removeAttribute("src");
        setTimeout(() => {
          if (!image.isConnected) return;
          waiting.add(image);
          next();
        }, RETRY_MS);
        done();
      };
      image.src = image.dataset.url ?? "";
    }
  }

  return { watch, forget };
}
