/** Load thumbnails one after the other while they are visible, so that they delay neither the page nor the program. */

const AT_ONCE = 2;
/** The program makes no thumbnails while it compiles or when too many wait. */
const RETRY_MS = 3000;

export class ThumbnailLoader {
  /** @type {Set<HTMLImageElement>} visible images that wait for their turn */
  #waiting = new Set();
  #loading = 0;
  #observer;

  /** @param {HTMLElement} scroller contains the images */
  constructor(scroller) {
    this.#observer = new IntersectionObserver(
      (entries) => {
        for (const { target, isIntersecting } of entries) {
          const image = /** @type {HTMLImageElement} */ (target);
          if (isIntersecting && !image.src) this.#waiting.add(image);
          else this.#waiting.delete(image);
        }
        this.#next();
      },
      { root: scroller, rootMargin: "80px" },
    );
  }

  /**
   * Load an image when it becomes visible.
   *
   * @param {HTMLImageElement} image
   * @param {string} url
   */
  watch(image, url) {
    image.dataset.url = url;
    this.#observer.observe(image);
  }

  /** @param {HTMLImageElement} image that was removed */
  forget(image) {
    this.#observer.unobserve(image);
    this.#waiting.delete(image);
  }

  #next() {
    for (const image of this.#waiting) {
      if (this.#loading >= AT_ONCE) return;
      this.#waiting.delete(image);
      this.#loading += 1;
      const done = () => {
        this.#loading -= 1;
        this.#next();
      };
      image.onload = done;
      image.onerror = () => {
        image.removeAttribute("src");
        setTimeout(() => {
          if (!image.isConnected) return;
          this.#waiting.add(image);
          this.#next();
        }, RETRY_MS);
        done();
      };
      image.src = image.dataset.url ?? "";
    }
  }
}
