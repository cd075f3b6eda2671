/** Which page is shown: `#/axis/line1.3F`. */

export class Route {
  #parts = $state.raw(partsOf(location.hash));

  constructor() {
    addEventListener("hashchange", () => {
      this.#parts = partsOf(location.hash);
    });
  }

  get page(): string {
    return this.#parts[0] ?? "plant";
  }

  /** What the page is about, such as an address. */
  get subject(): string {
    return this.#parts.slice(1).join("/");
  }
}

function partsOf(hash: string): string[] {
  return hash.replace(/^#\/?/, "").split("/").filter(Boolean).map(decodeURIComponent);
}

export function pathTo(page: string, subject = ""): string {
  return `#/${page}${subject && `/${subject.split("/").map(encodeURIComponent).join("/")}`}`;
}

export const route = new Route();
