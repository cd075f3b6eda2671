/** An editor of programs, in a shadow root: the page's policy allows no styles but its own. */

import { history, historyKeymap, insertNewlineKeepIndent } from "@codemirror/commands";
import { lintGutter, setDiagnostics } from "@codemirror/lint";
import { EditorState, StateEffect, StateField } from "@codemirror/state";
import { Decoration, type DecorationSet, EditorView, keymap, lineNumbers } from "@codemirror/view";

export interface Fault {
  line: number;
  column: number;
  message: string;
}

const runAt = StateEffect.define<number | undefined>();
const mark = Decoration.line({ class: "running" });
const runningLine = StateField.define<DecorationSet>({
  create: () => Decoration.none,
  update(marks, { effects, changes, state }) {
    for (const effect of effects) {
      if (!effect.is(runAt)) continue;
      const line = effect.value;
      return line && line <= state.doc.lines ? Decoration.set(mark.range(state.doc.line(line).from)) : Decoration.none;
    }
    return marks.map(changes);
  },
  provide: (field) => EditorView.decorations.from(field),
});

const LOOK = EditorView.theme({
  "&": { fontSize: "0.95rem", backgroundColor: "var(--card)", color: "var(--ink)", height: "100%" },
  ".cm-content": { caretColor: "var(--ink)", fontFamily: "ui-monospace, monospace" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  ".cm-gutters": { backgroundColor: "var(--paper)", color: "var(--soft)", borderColor: "var(--line)" },
  ".cm-tooltip": { backgroundColor: "var(--card)", color: "var(--ink)", borderColor: "var(--line)" },
  "&.cm-focused": { outline: "3px solid var(--accent)" },
  // Its own marks are images in its styles, which the page's policy does not let in.
  ".cm-lint-marker-error": { content: '"●"', color: "var(--bad)" },
  ".cm-lintRange-error": { backgroundImage: "none", textDecoration: "underline wavy var(--bad)" },
  ".running": { backgroundColor: "color-mix(in srgb, var(--accent) 25%, transparent)" },
  ".cm-selectionBackground, &.cm-focused .cm-selectionBackground": { backgroundColor: "var(--bar) !important" },
});

export class Editor {
  readonly #view: EditorView;

  constructor(host: HTMLElement, label: string, source: string, changed: (source: string) => void) {
    const root = host.shadowRoot ?? host.attachShadow({ mode: "open" });
    this.#view = new EditorView({
      parent: root,
      root,
      state: EditorState.create({
        doc: source,
        extensions: [
          LOOK,
          lineNumbers(),
          lintGutter(),
          history(),
          // All other keys do in it what they do in a text field: the whole keymap is a fifth of the pages' bytes.
          keymap.of([{ key: "Enter", run: insertNewlineKeepIndent, shift: insertNewlineKeepIndent }, ...historyKeymap]),
          runningLine,
          EditorView.contentAttributes.of({ "aria-label": label }),
          EditorView.updateListener.of((update) => update.docChanged && changed(update.state.doc.toString())),
        ],
      }),
    });
  }

  /** Replace what stands in it, unless that is the same. */
  show(source: string): void {
    const { doc } = this.#view.state;
    if (doc.toString() === source) return;
    this.#view.dispatch({ changes: { from: 0, to: doc.length, insert: source } });
  }

  mark(faults: readonly Fault[]): void {
    const { state } = this.#view;
    const marks = faults
      .filter(({ line }) => line <= state.doc.lines)
      .map(({ line, column, message }) => {
        const at = state.doc.line(line);
        return { from: Math.min(at.from + column - 1, at.to), to: at.to, severity: "error" as const, message };
      });
    this.#view.dispatch(setDiagnostics(state, marks));
  }

  /** Mark the line that is being executed. */
  run(line: number | undefined): void {
    this.#view.dispatch({ effects: runAt.of(line) });
  }

  end(): void {
    this.#view.destroy();
  }
}
