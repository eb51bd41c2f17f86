// What people call rooms and things: given, changed and taken away on the map.

import { useState } from "preact/hooks";
import { api } from "../api";
import type { Schemas } from "../api";
import type { Point } from "../geometry";
import { useSite } from "../site";
import { Act, Field, Form, many } from "../ui";
import { AIM_HINT, useAim } from "./aim";
import { annotated } from "./chosen";

/** A room that was clicked, with a field for its name. */
export function RoomNote({ room, onClose }: { room: Schemas["Room"]; onClose: () => void }) {
  const { site, map } = useSite();
  const [name, setName] = useState(room.name ?? "");
  const give = async () => {
    if (!map) return;
    const query = { version: map.version };
    // A room that has a name has the annotation that gave it.
    const named = room.name ? await api.get("/v1/sites/{site}/annotations", { path: { site }, query: { ...query, kind: "room", component: room.component, limit: 10_000 } }) : undefined;
    const old = named?.items.find((annotation) => annotation.name === room.name);
    const geometry: Schemas["Shape"] = old?.geometry ?? { type: "Point", coordinates: [room.centre.x, room.centre.y] };
    const body = { kind: "room", name: name.trim(), component: room.component, geometry };
    if (old) await api.put("/v1/sites/{site}/annotations/{id}", { path: { site, id: old.id }, query, body });
    else await api.post("/v1/sites/{site}/annotations", { path: { site }, query, body });
    annotated.set(annotated.get() + 1);
    onClose();
  };
  return (
    <>
      <p>
        <strong>{room.name ?? `${room.label} ${room.id}`}</strong>: {room.area_m2.toFixed(1)} m², {many(room.doors.length, "door")}
      </p>
      <Form act={give} label="Name of the room">
        <div class="row">
          <Field label="What people call it" value={name} maxLength={200} autocomplete="off" onInput={(event) => setName(event.currentTarget.value)} />
          <button type="submit" class="main" disabled={!name.trim() || name.trim() === room.name}>
            Name it
          </button>
        </div>
      </Form>
    </>
  );
}

/** Something that people drew, and taking it away. */
export function AnnotationNote({ annotation, onClose }: { annotation: Schemas["Annotation"]; onClose: () => void }) {
  const { site } = useSite();
  const remove = async () => {
    await api.delete("/v1/sites/{site}/annotations/{id}", { path: { site, id: annotation.id } });
    annotated.set(annotated.get() + 1);
    onClose();
  };
  return (
    <>
      <p>
        <strong>{annotation.name}</strong> ({annotation.kind})
      </p>
      <Act kind="danger" act={remove}>
        Delete {annotation.name}
      </Act>
    </>
  );
}

/** Puts something onto the map: a kind, a name, and a click where it is. */
export function NewAnnotation() {
  const { site, map, component } = useSite();
  const aim = useAim();
  const [kind, setKind] = useState("dock");
  const [name, setName] = useState("");
  const [point, setPoint] = useState<Point | undefined>();
  const add = async () => {
    if (!point || !map) return;
    const body = { kind: kind.trim(), name: name.trim(), component, geometry: { type: "Point" as const, coordinates: [point.x, point.y] } };
    await api.post("/v1/sites/{site}/annotations", { path: { site }, query: { version: map.version }, body });
    annotated.set(annotated.get() + 1);
    setName("");
    setPoint(undefined);
  };
  return (
    <Form class="sub" act={add} label="New annotation">
      <Field label="What sort of thing" value={kind} required maxLength={64} autocomplete="off" onInput={(event) => setKind(event.currentTarget.value)} />
      <Field label="What people call it" value={name} required maxLength={200} autocomplete="off" onInput={(event) => setName(event.currentTarget.value)} />
      <div class="row">
        <button type="button" class="plain" aria-pressed={aim.wanted !== undefined} onClick={() => aim.ask("place", setPoint)}>
          {point ? `At ${point.x.toFixed(1)}, ${point.y.toFixed(1)} m` : "Set place"}
        </button>
        <button type="submit" class="main" disabled={!point || !name.trim() || !kind.trim()}>
          Add it
        </button>
      </div>
      {aim.wanted && <p class="soft">{AIM_HINT}</p>}
    </Form>
  );
}
