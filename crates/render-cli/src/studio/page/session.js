// What is being made: the fabric, how it is looked at, what was before, and what the server says of it.

import { Refusal, get, listen, post } from "./api.js";

/** Most steps that can be undone. */
const HISTORY = 300;

/** The name of a file without its folder, or that of a preset. */
const shortName = (name) => name.split(/[\\/]/).pop().replace(/^preset:/, "");

export class Session {
  #listeners = new Map();
  #past = [];
  #future = [];
  #gesture = null;
  #posting = null;
  #isWaiting = false;
  #newest = { revision: 0, draw: null };
  #draftOnServer = null;
  #placements = {};
  #isStale = { cloth: false, draft: false };

  /** The file format's own object, with its draft in it. */
  fabric = null;
  name = "";
  view = null;
  savesTo = null;
  /** The answer to the last document that was taken. */
  answer = null;
  /** `api/cloth` and `api/draft` of the newest answer. */
  cloth = null;
  draft = null;
  /** `api/parameters`, which never changes. */
  parameters = null;
  prepared = null;
  frame = null;
  /** The crossing that is pointed at, `{ end, pick }`, or null. */
  crossing = null;
  /** Whether frames show nothing that is not seen already, until the last one. */
  keepsPicture = false;
  /** The built-in placements of camera and light by kind. */
  defaults = {};

  /**
   * Calls `action` on each of the space-separated `topics`: fabric, view, history, answer, refused,
   * cloth, draft, frame, prepared, thumbnail, crossing, shown.
   */
  on(topics, action) {
    for (const topic of topics.split(" ")) {
      if (!this.#listeners.has(topic)) this.#listeners.set(topic, []);
      this.#listeners.get(topic).push(action);
    }
  }

  emit(topic, detail) {
    for (const action of this.#listeners.get(topic) ?? []) action(detail);
  }

  async start() {
    const start = await get("document");
    this.fabric = start.fabric;
    this.view = start.view;
    this.name = shortName(start.name);
    this.savesTo = start.saves_to;
    this.defaults = start.defaults;
    this.answer = start;
    this.#draftOnServer = this.fabric.draft;
    this.#newest = { revision: start.revision, draw: null };
    this.#placements[this.view.kind] = { camera: this.view.camera, light: this.view.light };
    await this.#describe(true);
    this.emit("fabric");
    this.emit("view");
    this.emit("history");
    this.emit("answer");
    listen({
      frame: (frame) => this.#onFrame(frame),
      prepared: (prepared) => {
        const owner = this.#ownerOf(prepared.revision);
        if (!owner || owner.draw) return;
        this.prepared = prepared;
        this.emit("prepared");
      },
      document: ({ revision }) => this.#onDocument(revision),
      failed: (failed) => {
        if (this.#ownerOf(failed.revision)) this.emit("refused", failed);
      },
      thumbnail: ({ name }) => this.emit("thumbnail", name),
    });
  }

  /**
   * Takes `fabric` for the present one. Edits of one `gesture`, as while a slider is dragged, are
   * undone together.
   */
  edit(fabric, { gesture = null, name = this.name } = {}) {
    if (gesture === null || gesture !== this.#gesture) {
      this.#past.push({ fabric: this.fabric, name: this.name });
      if (this.#past.length > HISTORY) this.#past.shift();
      this.#future = [];
    }
    this.#gesture = gesture;
    this.#put(fabric, name);
  }

  /** Ends a gesture: the next edit is a step of its own. */
  endGesture() {
    this.#gesture = null;
  }

  canUndo() {
    return this.#past.length > 0;
  }

  canRedo() {
    return this.#future.length > 0;
  }

  undo() {
    this.#step(this.#past, this.#future);
  }

  redo() {
    this.#step(this.#future, this.#past);
  }

  #step(from, to) {
    const next = from.pop();
    if (!next) return;
    to.push({ fabric: this.fabric, name: this.name });
    this.#gesture = null;
    this.#put(next.fabric, next.name);
  }

  #put(fabric, name) {
    this.keepsPicture = false;
    this.fabric = fabric;
    this.name = name;
    // First, so that the server is at work while the page is brought up to date.
    this.#submit();
    this.emit("fabric");
    this.emit("history");
  }

  /** Changes how the cloth is looked at. A kind that was seen before is seen as it was then. */
  look(change) {
    const view = { ...this.view, ...change };
    if (change.kind && change.kind !== this.view.kind) {
      const { camera = null, light = null } = this.#placements[change.kind] ?? {};
      Object.assign(view, { camera, light });
    }
    this.keepsPicture = false;
    this.view = view;
    this.#placements[view.kind] = { camera: view.camera, light: view.light };
    this.#submit();
    this.emit("view");
  }

  /** Where camera and light stand. */
  placement() {
    const preset = this.defaults[this.view.kind] ?? {};
    return {
      camera: this.view.camera ?? preset.camera ?? null,
      light: this.view.light ?? preset.light ?? null,
    };
  }

  /** Points at a crossing, or at none: `{ end, pick }`, threads from 1. */
  point(crossing, detail = null) {
    this.crossing = crossing;
    this.emit("crossing", detail);
  }

  /**
   * Draws `fabric` in the present view in place of the present one, and calls `draw` with each frame,
   * until it is done or something else is drawn. False if something else is under way.
   */
  async drawOther(fabric, draw) {
    if (this.#posting) return false;
    await this.#post({ fabric, view: this.view, aside: true }, draw);
    return true;
  }

  /** Draws again what is seen already, so that the server is about it once more. */
  redraw() {
    this.keepsPicture = true;
    this.#submit();
  }

  async #submit() {
    const { fabric, view } = this;
    const isNewDraft = fabric.draft !== this.#draftOnServer;
    const { draft, ...rest } = fabric;
    if (this.#posting) {
      this.#isWaiting = true;
      return;
    }
    try {
      const answer = await this.#post({ fabric: isNewDraft ? fabric : rest, view, name: this.name }, null);
      this.answer = answer;
      this.emit("answer");
      this.#describe(isNewDraft);
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      this.emit("refused", error);
    }
  }

  // One document at a time is on its way, and after it the newest of those that came meanwhile: so it
  // is known whose a revision is whose answer has not come yet.
  async #post(document, draw) {
    this.#posting = { draw };
    try {
      const answer = await post("document", document);
      this.#newest = { revision: answer.revision, draw };
      if (document.fabric.draft) this.#draftOnServer = document.fabric.draft;
      return answer;
    } finally {
      this.#posting = null;
      if (this.#isWaiting) {
        this.#isWaiting = false;
        this.#submit();
      } else {
        this.#follow();
      }
    }
  }

  /** The newest revision that the server has told of. */
  #told = 0;

  #onDocument(revision) {
    this.#told = Math.max(this.#told, revision);
    this.#follow();
  }

  // Another page has changed what is shown: this one follows, and can undo that.
  async #follow() {
    if (this.#posting || this.#told <= this.#newest.revision) return;
    this.#posting = { draw: null };
    let next = null;
    try {
      next = await get("document");
      this.#newest = { revision: next.revision, draw: null };
    } finally {
      this.#posting = null;
    }
    // What was changed here meanwhile is newer.
    if (this.#isWaiting) {
      this.#isWaiting = false;
      this.#submit();
      return;
    }
    const isNewDraft = JSON.stringify(next.fabric.draft) !== JSON.stringify(this.fabric.draft);
    const isOther = isNewDraft || JSON.stringify(next.fabric) !== JSON.stringify(this.fabric);
    if (isOther) {
      this.#past.push({ fabric: this.fabric, name: this.name });
      this.fabric = next.fabric;
      this.#draftOnServer = this.fabric.draft;
    }
    this.name = shortName(next.name);
    this.view = next.view;
    this.#placements[this.view.kind] = { camera: this.view.camera, light: this.view.light };
    this.answer = next;
    await this.#describe(isNewDraft);
    for (const topic of ["fabric", "view", "history", "answer"]) this.emit(topic);
    this.#follow();
  }

  /** Whether this revision is the last that was asked for. */
  isCurrent(revision) {
    return revision === this.#newest.revision && !this.#posting;
  }

  /** Whose this revision is: `{ draw }`, or null if it is none that still counts. */
  #ownerOf(revision) {
    if (revision === this.#newest.revision) return this.#newest;
    return revision > this.#newest.revision ? this.#posting : null;
  }

  #describing = null;

  // One description at a time, and another after it where something has changed meanwhile.
  async #describe(isNewDraft) {
    this.#isStale.cloth = true;
    this.#isStale.draft ||= isNewDraft;
    if (this.#describing) return this.#describing;
    const run = async () => {
      while (this.#isStale.cloth) {
        const withDraft = this.#isStale.draft;
        this.#isStale = { cloth: false, draft: false };
        const parts = [get("cloth"), withDraft || !this.draft ? get("draft") : this.#yarnsOfThreads()];
        const [cloth, draft] = await Promise.all(parts);
        this.cloth = cloth;
        this.draft = draft;
        if (withDraft) this.emit("draft");
        this.emit("cloth");
      }
    };
    this.#describing = run().finally(() => {
      this.#describing = null;
    });
    return this.#describing;
  }

  // Types of yarn are told apart by the rules, and by colour and size where no rule sets them.
  async #yarnsOfThreads() {
    const openness = ({ yarn = {} }) => [yarn.color != null, yarn.size != null];
    const overrides = this.fabric.overrides ?? [];
    const rules = JSON.stringify([
      openness(this.fabric),
      ...overrides.map((rule) => [rule.warp, rule.color, rule.threads, ...openness(rule)]),
    ]);
    if (rules === this.#rules) return this.draft;
    this.#rules = rules;
    return get("draft");
  }

  #rules = null;

  #onFrame(frame) {
    const owner = this.#ownerOf(frame.revision);
    if (owner?.draw) {
      owner.draw(frame);
    } else if (owner) {
      this.frame = frame;
      this.emit("frame", frame);
    }
  }
}
