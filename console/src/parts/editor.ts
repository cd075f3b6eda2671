/** An editor of programs, in a shadow root: the page's policy allows no styles but its own. */

import * as edit from "@codemirror/commands";
import { EditorState, RangeSet, StateEffect, StateField } from "@codemirror/state";
import { type Command, Decoration, type DecorationSet, EditorView, GutterMarker, type KeyBinding, gutter, keymap, lineNumbers } from "@codemirror/view";

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

/** A dot beside a line that has a fault; it says which to whoever points at it. */
class FaultMarker extends GutterMarker {
  constructor(readonly message: string) {
    super();
  }

  override toDOM(): HTMLElement {
    const dot = Object.assign(document.createElement("span"), { className: "cm-lint-marker-error", title: this.message });
    dot.setAttribute("role", "img");
    dot.setAttribute("aria-label", this.message);
    return dot;
  }
}

interface Faulty {
  marks: DecorationSet;
  dots: RangeSet<GutterMarker>;
}

const setFaults = StateEffect.define<readonly Fault[]>();
const faulty = StateField.define<Faulty>({
  create: () => ({ marks: Decoration.none, dots: RangeSet.empty }),
  update({ marks, dots }, { effects, changes, state }) {
    const told = effects.find((effect) => effect.is(setFaults));
    if (!told) return { marks: marks.map(changes), dots: dots.map(changes) };
    const faults = (told.value as readonly Fault[]).filter(({ line }) => line <= state.doc.lines);
    const spans = faults.flatMap(({ line, column, message }) => {
      const at = state.doc.line(line);
      const from = Math.min(at.from + column - 1, at.to);
      return from < at.to ? [Decoration.mark({ class: "fault", attributes: { title: message } }).range(from, at.to)] : [];
    });
    const shown = faults.map(({ line, message }) => new FaultMarker(message).range(state.doc.line(line).from));
    return { marks: Decoration.set(spans, true), dots: RangeSet.of(shown, true) };
  },
  provide: (field) => [
    EditorView.decorations.from(field, ({ marks }) => marks),
    gutter({ class: "faults", markers: ({ state }) => state.field(field).dots }),
  ],
});

const LOOK = EditorView.theme({
  "&": { fontSize: "0.95rem", backgroundColor: "var(--card)", color: "var(--ink)", height: "100%" },
  ".cm-content": { caretColor: "var(--ink)", fontFamily: "ui-monospace, monospace" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  ".cm-gutters": { backgroundColor: "var(--paper)", color: "var(--soft)", borderColor: "var(--line)" },
  ".cm-tooltip": { backgroundColor: "var(--card)", color: "var(--ink)", borderColor: "var(--line)" },
  "&.cm-focused": { outline: "3px solid var(--accent)" },
  ".faults": { width: "1.2em", textAlign: "center" },
  ".cm-lint-marker-error::before": { content: '"●"', color: "var(--bad)" },
  ".fault": { textDecoration: "underline wavy var(--bad)" },
  ".running": { backgroundColor: "color-mix(in srgb, var(--accent) 25%, transparent)" },
  ".cm-selectionBackground, &.cm-focused .cm-selectionBackground": { backgroundColor: "var(--bar) !important" },
});

function way(keys: Partial<KeyBinding>, run: Command, shift: Command): KeyBinding {
  return { ...keys, run, shift, preventDefault: true };
}

/** Delete what is selected, or else what this command selects. */
function erasing(select: Command): Command {
  return (view) => {
    if (view.state.selection.main.empty) select(view);
    view.dispatch({ ...view.state.replaceSelection(""), userEvent: "delete", scrollIntoView: true });
    return true;
  };
}

/** Those of its own list that need no grammar of the language: that would be a third of the editor. Escape stops. */
const KEYS: readonly KeyBinding[] = [
  way({ key: "ArrowLeft" }, edit.cursorCharLeft, edit.selectCharLeft),
  way({ key: "ArrowRight" }, edit.cursorCharRight, edit.selectCharRight),
  way({ key: "Mod-ArrowLeft", mac: "Alt-ArrowLeft" }, edit.cursorGroupLeft, edit.selectGroupLeft),
  way({ key: "Mod-ArrowRight", mac: "Alt-ArrowRight" }, edit.cursorGroupRight, edit.selectGroupRight),
  way({ key: "ArrowUp" }, edit.cursorLineUp, edit.selectLineUp),
  way({ key: "ArrowDown" }, edit.cursorLineDown, edit.selectLineDown),
  way({ key: "PageUp" }, edit.cursorPageUp, edit.selectPageUp),
  way({ key: "PageDown" }, edit.cursorPageDown, edit.selectPageDown),
  way({ key: "Home", mac: "Cmd-ArrowLeft" }, edit.cursorLineBoundaryBackward, edit.selectLineBoundaryBackward),
  way({ key: "End", mac: "Cmd-ArrowRight" }, edit.cursorLineBoundaryForward, edit.selectLineBoundaryForward),
  way({ key: "Mod-Home", mac: "Cmd-ArrowUp" }, edit.cursorDocStart, edit.selectDocStart),
  way({ key: "Mod-End", mac: "Cmd-ArrowDown" }, edit.cursorDocEnd, edit.selectDocEnd),
  way({ key: "Enter" }, edit.insertNewlineKeepIndent, edit.insertNewlineKeepIndent),
  way({ key: "Backspace" }, erasing(edit.selectCharLeft), erasing(edit.selectCharLeft)),
  { key: "Delete", run: erasing(edit.selectCharRight) },
  { key: "Mod-Backspace", mac: "Alt-Backspace", run: erasing(edit.selectGroupLeft) },
  { key: "Mod-Delete", mac: "Alt-Delete", run: erasing(edit.selectGroupRight) },
  { key: "Mod-a", run: edit.selectAll },
];

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
          faulty,
          edit.history(),
          keymap.of([...KEYS, ...edit.historyKeymap]),
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
    this.#view.dispatch({ effects: setFaults.of(faults) });
  }

  /** Mark the line that is being executed. */
  run(line: number | undefined): void {
    this.#view.dispatch({ effects: runAt.of(line) });
  }

  end(): void {
    this.#view.destroy();
  }
}
