/** Whether each button has its request beside it, to be copied as a command line. */

const KEPT = "motion-gateway.calls";

class Calls {
  shown = $state(localStorage.getItem(KEPT) === "yes");

  toggle(): void {
    this.shown = !this.shown;
    localStorage.setItem(KEPT, this.shown ? "yes" : "no");
  }
}

export const calls = new Calls();
