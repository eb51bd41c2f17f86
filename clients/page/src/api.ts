// The server, with the key that this browser keeps for it.

import { Client, Refused } from "../../typescript/src/index.js";
import type { Schemas } from "../../typescript/src/index.js";
import { Cell } from "./cell";

export type { Schemas };
export { Refused };

const KEY_NAME = "locution-key";

/** The key, kept for this tab or for this browser. */
export const apiKey = new Cell<string>(
  sessionStorage.getItem(KEY_NAME) ?? localStorage.getItem(KEY_NAME) ?? "",
);

/** Whether the server has refused for want of a key. */
export const isKeyWanted = new Cell(false);

/** Takes a key; an empty one is forgotten. */
export function useKey(key: string, isKept: boolean): void {
  sessionStorage.removeItem(KEY_NAME);
  localStorage.removeItem(KEY_NAME);
  if (key) (isKept ? localStorage : sessionStorage).setItem(KEY_NAME, key);
  isKeyWanted.set(false);
  apiKey.set(key);
}

/** `fetch` with the key. */
export async function fetchWithKey(input: RequestInfo | URL, init: RequestInit = {}): Promise<Response> {
  const headers = new Headers(init.headers);
  const key = apiKey.get();
  if (key) headers.set("authorization", `Bearer ${key}`);
  const response = await fetch(input, { ...init, headers });
  if (response.status === 401) isKeyWanted.set(true);
  return response;
}

/** The server that served this page. */
export const api = new Client(location.origin, { fetch: fetchWithKey });

/** Most items the page asks for at once. */
const PAGE_ITEMS = 10_000;

/** All items of a paged list under a path without variables, at most `max`. */
export async function listAll<T>(path: string, query: Record<string, string>, signal: AbortSignal, max = 200_000): Promise<T[]> {
  const items: T[] = [];
  let cursor: string | null = null;
  do {
    const page: { items: T[]; next_cursor?: string | null } = await getJson(
      path,
      { ...query, limit: String(PAGE_ITEMS), ...(cursor ? { cursor } : {}) },
      signal,
    );
    for (const item of page.items) items.push(item);
    cursor = page.next_cursor ?? null;
  } while (cursor && items.length < max);
  return items;
}

/** One JSON answer. */
export async function getJson<T>(path: string, query: Record<string, string>, signal?: AbortSignal): Promise<T> {
  const answer = await fetchWithKey(`${path}?${new URLSearchParams(query)}`, {
    headers: { accept: "application/json" },
    ...(signal ? { signal } : {}),
  });
  if (!answer.ok) throw await refusalOf(answer);
  return (await answer.json()) as T;
}

/** A refusal with the server's own words. */
export async function refusalOf(answer: Response): Promise<Refused> {
  const text = await answer.text();
  try {
    return new Refused(answer.status, JSON.parse(text));
  } catch {
    const detail = text.slice(0, 300) || answer.statusText;
    return new Refused(answer.status, { type: "about:blank", title: "Refused", status: answer.status, detail });
  }
}

/** The path of a site, and of what is below it. */
export function sitePath(site: string, ...rest: string[]): string {
  return ["/v1/sites", encodeURIComponent(site), ...rest.map(encodeURIComponent)].join("/");
}

/** Saves an answer as a file; a plain link could not carry the key. */
export async function save(path: string, name: string, edit?: (text: string) => string): Promise<void> {
  const answer = await fetchWithKey(path);
  if (!answer.ok) throw await refusalOf(answer);
  const link = document.createElement("a");
  link.href = URL.createObjectURL(edit ? new Blob([edit(await answer.text())]) : await answer.blob());
  link.download = name;
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** What went wrong, for people. */
export function wordsOf(error: unknown): string {
  if (error instanceof Refused) {
    return error.problem.field ? `${error.problem.field}: ${error.problem.detail}` : error.problem.detail;
  }
  if (error instanceof TypeError && /fetch/i.test(error.message)) return "The server does not answer.";
  return error instanceof Error ? error.message : String(error);
}

/** Whether the server refused with this status. */
export function isStatus(error: unknown, status: number): boolean {
  return error instanceof Refused && error.status === status;
}
