// The server, as functions. Every URL is relative: the base of the page carries the token.

/** What the server answered when it did not do what it was asked. */
export class Refusal extends Error {
  constructor(status, { errors = [], diagnostics = [] }) {
    super(errors.join("\n") || `the server answered ${status}`);
    this.status = status;
    this.errors = errors;
    this.diagnostics = diagnostics;
  }
}

async function answer(request) {
  let response;
  try {
    response = await request;
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Refusal(0, { errors: ["the studio does not answer: is it still running?"] });
  }
  if (response.ok) return response;
  throw new Refusal(response.status, await response.json().catch(() => ({})));
}

const json = async (request) => (await answer(request)).json();

/** The answer to GET `path`. */
export const get = (path, options) => json(fetch(`api/${path}`, options));

/** The answer to POST `path` with `body` in JSON. */
export const post = (path, body) =>
  json(fetch(`api/${path}`, {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify(body),
  }));

/** The answer to POST `path` with the bytes of `file`. */
export const send = (path, file) =>
  json(fetch(`api/${path}`, {
    method: "POST",
    headers: { "content-type": "application/octet-stream" },
    body: file,
  }));

/** A picture of the server, ready to be drawn. */
export async function picture(path, options) {
  const response = await answer(fetch(`api/${path}`, options));
  return createImageBitmap(await response.blob());
}

/** Calls `handlers[name]` with each event of that name. */
export function listen(handlers) {
  const source = new EventSource("api/events");
  for (const [name, handler] of Object.entries(handlers)) {
    source.addEventListener(name, (event) => handler(JSON.parse(event.data)));
  }
  return source;
}
