// A small client over `fetch`: paths, parameters, bodies and answers have the types of the API's document.

import type { components, operations, paths } from "./schema.js";

/** Bodies by their names in the document, such as `Schemas["Match"]`. */
export type Schemas = components["schemas"];

/** What went wrong (RFC 9457). */
export type Problem = Schemas["Problem"];

type Method = "get" | "put" | "post" | "delete" | "patch";

/** Paths of the document that know a method. */
export type PathsWith<M extends Method> = {
  [P in keyof paths]: paths[P][M] extends { responses: unknown } ? P : never;
}[keyof paths];

type Operation<P extends keyof paths, M extends Method> = paths[P][M];

type ParametersOf<O, Place extends string> = O extends { parameters: infer All }
  ? All extends { [K in Place]?: infer Values }
    ? Values
    : never
  : never;

type BodyOf<O> = O extends { requestBody?: infer Body }
  ? NonNullable<Body> extends { content: { "application/json": infer Json } }
    ? Json
    : never
  : never;

type SuccessOf<O> = O extends { responses: infer Responses }
  ? Responses extends { 200: { content: infer Content } }
    ? Content
    : Responses extends { 201: { content: infer Content } }
      ? Content
      : never
  : never;

/** The JSON answer of an operation; `undefined` where it answers none. */
export type Answer<P extends keyof paths, M extends Method> = SuccessOf<Operation<P, M>> extends {
  "application/json": infer Json;
}
  ? Json
  : undefined;

/** What a request carries. */
export interface Request<O> {
  /** Names in the path. */
  path?: ParametersOf<O, "path">;
  /** Parameters after the question mark. */
  query?: ParametersOf<O, "query">;
  /** The body, sent as JSON. */
  body?: BodyOf<O>;
  /** Ends the request early. */
  signal?: AbortSignal;
}

/** The server said no. */
export class Refused extends Error {
  constructor(
    readonly status: number,
    readonly problem: Problem,
  ) {
    super(`${status}: ${problem.field ? `${problem.field}: ` : ""}${problem.detail}`);
    this.name = "Refused";
  }
}

/** How a client reaches its server. */
export interface Options {
  /** Sent as `Authorization: Bearer …`. */
  apiKey?: string;
  /** Another `fetch`, such as one of a test. */
  fetch?: typeof fetch;
}

/** A server of the Locution API. */
export class Client {
  private readonly url: string;

  constructor(
    url: string,
    private readonly options: Options = {},
  ) {
    this.url = url.replace(/\/+$/, "");
  }

  get<P extends PathsWith<"get">>(path: P, request: Request<Operation<P, "get">> = {}): Promise<Answer<P, "get">> {
    return this.json("get", path, request);
  }

  put<P extends PathsWith<"put">>(path: P, request: Request<Operation<P, "put">> = {}): Promise<Answer<P, "put">> {
    return this.json("put", path, request);
  }

  post<P extends PathsWith<"post">>(path: P, request: Request<Operation<P, "post">> = {}): Promise<Answer<P, "post">> {
    return this.json("post", path, request);
  }

  delete<P extends PathsWith<"delete">>(
    path: P,
    request: Request<Operation<P, "delete">> = {},
  ): Promise<Answer<P, "delete">> {
    return this.json("delete", path, request);
  }

  /** Any form of the map and other answers that are no JSON. */
  async download<P extends PathsWith<"get">>(path: P, request: Request<Operation<P, "get">> = {}): Promise<Blob> {
    return (await this.send("get", path, request, "*/*")).blob();
  }

  /** All items of a paged list, page after page. */
  async *all<P extends PathsWith<"get">>(
    path: P,
    request: Request<Operation<P, "get">> = {},
  ): AsyncGenerator<Answer<P, "get"> extends { items: (infer Item)[] } ? Item : never> {
    let cursor: string | null | undefined;
    do {
      const query = cursor ? { ...(request.query as object), cursor } : request.query;
      const page = (await this.json("get", path, { ...request, query } as typeof request)) as {
        items: (Answer<P, "get"> extends { items: (infer Item)[] } ? Item : never)[];
        next_cursor?: string | null;
      };
      yield* page.items;
      cursor = page.next_cursor;
    } while (cursor);
  }

  private async json<P extends keyof paths, M extends Method>(
    method: M,
    path: P,
    request: Request<Operation<P, M>>,
  ): Promise<Answer<P, M>> {
    const response = await this.send(method, path, request, "application/json");
    return (response.status === 204 ? undefined : await response.json()) as Answer<P, M>;
  }

  private async send<O>(method: Method, path: string, request: Request<O>, accept: string): Promise<Response> {
    const names = (request.path ?? {}) as Record<string, string>;
    const filled = path.replace(/\{(\w+)\}/g, (_, name: string) => encodeURIComponent(names[name] ?? ""));
    const query = new URLSearchParams();
    for (const [name, value] of Object.entries((request.query ?? {}) as Record<string, unknown>)) {
      if (value !== undefined && value !== null) query.set(name, String(value));
    }
    const headers: Record<string, string> = { accept };
    if (this.options.apiKey) headers["authorization"] = `Bearer ${this.options.apiKey}`;
    if (request.body !== undefined) headers["content-type"] = "application/json";
    const call = this.options.fetch ?? fetch;
    const response = await call(`${this.url}${filled}${query.size ? `?${query}` : ""}`, {
      method: method.toUpperCase(),
      headers,
      ...(request.body === undefined ? {} : { body: JSON.stringify(request.body) }),
      ...(request.signal === undefined ? {} : { signal: request.signal }),
    });
    if (!response.ok) {
      const text = await response.text();
      throw new Refused(response.status, problemOf(response.status, text));
    }
    return response;
  }
}

/** The problem of an answer, also of one that came from something between client and server. */
function problemOf(status: number, text: string): Problem {
  try {
    return JSON.parse(text) as Problem;
  } catch {
    return { type: "about:blank", title: `HTTP ${status}`, status, detail: text.slice(0, 300) };
  }
}

export type { components, operations, paths };
