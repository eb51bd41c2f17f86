// Where in the page one is: everything that is shown stands in the address, so that every view can be linked to.
//
// The address is `/ui#/sites/office/map?layers=walls,runs&at=12.0,4.5,20`: a path, and parameters as in a query.

import { Cell, useCell } from "./cell";

/** A view and its parameters. */
export interface Place {
  path: string[];
  query: URLSearchParams;
}

function placeOf(hash: string): Place {
  const [path = "", query = ""] = hash.replace(/^#\/?/, "").split("?");
  const parts = path.split("/").filter(Boolean);
  return { path: parts.map(decodePart), query: new URLSearchParams(query) };
}

function decodePart(part: string): string {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

const current = new Cell(placeOf(location.hash));
window.addEventListener("hashchange", () => current.set(placeOf(location.hash)));

/** The address of a view. */
export function addressOf(path: string[], query: Record<string, string | undefined> | URLSearchParams = {}): string {
  const params = new URLSearchParams();
  const pairs = query instanceof URLSearchParams ? [...query] : Object.entries(query);
  for (const [name, value] of pairs) if (value !== undefined && value !== "") params.set(name, value);
  // Commas and colons may stand in a fragment; addresses are easier to read with them.
  const text = params.toString().replaceAll("%2C", ",").replaceAll("%3A", ":");
  return `#/${path.map(encodeURIComponent).join("/")}${text ? `?${text}` : ""}`;
}

/** The view that is shown. */
export function usePlace(): Place {
  return useCell(current);
}

/** The view that is shown, outside of components. */
export function placeNow(): Place {
  return current.get();
}

/** Goes to a view. */
export function go(path: string[], query: Record<string, string | undefined> | URLSearchParams = {}): void {
  location.hash = addressOf(path, query);
}

/** Changes parameters of the view that is shown; without a new entry in the browser's history when `isQuiet`. */
export function patch(changes: Record<string, string | undefined>, isQuiet = true): void {
  const place = current.get();
  const query = new URLSearchParams(place.query);
  for (const [name, value] of Object.entries(changes)) {
    if (value === undefined || value === "") query.delete(name);
    else query.set(name, value);
  }
  const address = addressOf(place.path, query);
  if (address === location.hash) return;
  if (isQuiet) {
    history.replaceState(null, "", address);
    current.set(placeOf(address));
  } else {
    location.hash = address;
  }
}
