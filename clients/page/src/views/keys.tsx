// Keys of the server: made, listed, given another secret, revoked. A secret is shown once.

import { useEffect, useState } from "preact/hooks";
import { api, apiKey, isStatus, useKey } from "../api";
import type { Schemas } from "../api";
import { useCell, useLoaded } from "../cell";
import { Alert, Choice, Confirm, Dialog, Field, Form, Tick, count } from "../ui";
import { isName } from "../upload";

const SCOPES = [
  ["read", "read: look, ask, localize"],
  ["write", "write: also send runs, build, decide"],
  ["admin", "admin: also make and delete sites and keys"],
] as const;

const DAY_S = 86_400;
const LIFETIMES = [
  ["", "for good"],
  [String(DAY_S), "a day"],
  [String(30 * DAY_S), "30 days"],
  [String(365 * DAY_S), "a year"],
] as const;

const GRACES = [
  ["0", "stops at once"],
  ["3600", "stays valid for an hour"],
  [String(DAY_S), "stays valid for a day"],
  [String(7 * DAY_S), "stays valid for a week"],
] as const;

/** What is open over the list. */
type Open = { kind: "secret"; issued: Schemas["IssuedKey"]; isFirst: boolean } | { kind: "rotate" | "revoke"; key: Schemas["Key"] };

export function KeysPage() {
  const keys = useLoaded((signal) => api.get("/v1/keys", { signal }), "");
  const [open, setOpen] = useState<Open | undefined>();
  const close = () => setOpen(undefined);
  useEffect(() => {
    document.title = "Keys · Locution";
  }, []);
  const items = keys.value?.items ?? [];
  const isOpenServer = keys.value !== undefined && items.length === 0;
  const issue = (issued: Schemas["IssuedKey"]) => {
    setOpen({ kind: "secret", issued, isFirst: isOpenServer });
    // The first key locks the server, so the list can be asked for only with a key; that is taken up in the dialog.
    if (!isOpenServer) keys.reload();
  };
  return (
    <main class="page" id="content">
      <h1>Keys</h1>
      <p class="soft">A key opens its sites to whoever sends it: a robot, a program, a browser. Give each its own, so that one can be revoked without the others.</p>
      {isStatus(keys.error, 403) ? <p>Only a key of scope admin may see keys; the one in this browser is none.</p> : <Alert error={keys.error} />}
      {isOpenServer && (
        <div class="card">
          <p>This server has no keys: it serves whoever is on its machine, and nobody else.</p>
          <p>The first key is an administrator of all sites. From the moment it is made, the server asks everybody for a key.</p>
        </div>
      )}
      {items.length > 0 && (
        <ul class="list keys">
          {items.map((key) => (
            <li key={key.name} class="job">
              <KeyLine shown={key} onOpen={setOpen} />
            </li>
          ))}
        </ul>
      )}
      {keys.value && <NewKey isFirst={isOpenServer} onIssued={issue} />}
      {open?.kind === "secret" && (
        <Secret
          issued={open.issued}
          isFirst={open.isFirst}
          onClose={() => {
            close();
            keys.reload();
          }}
        />
      )}
      {open?.kind === "rotate" && <Rotation shown={open.key} onIssued={issue} onClose={close} />}
      {open?.kind === "revoke" && (
        <Confirm
          title={`Revoke ${open.key.name}?`}
          word={open.key.name}
          verb="Revoke it"
          act={async () => {
            await api.delete("/v1/keys/{key}", { path: { key: open.key.name } });
            keys.reload();
          }}
          onClose={close}
        >
          <p>Whoever sends this key is refused from now on. This cannot be undone.</p>
        </Confirm>
      )}
    </main>
  );
}

function KeyLine({ shown, onOpen }: { shown: Schemas["Key"]; onOpen: (open: Open) => void }) {
  const sites = shown.sites.includes("*") ? "all sites" : shown.sites.join(", ");
  const limits = [
    typeof shown.requests_per_s_max === "number" && `${count(shown.requests_per_s_max)} requests/s at most`,
    typeof shown.num_localisations_max === "number" && `${count(shown.num_localisations_max)} localizations at most`,
    typeof shown.created_at_s === "number" && `made ${day(shown.created_at_s)}`,
    typeof shown.previous_valid_until_s === "number" && 1000 * shown.previous_valid_until_s > Date.now() && `secret before valid until ${moment(shown.previous_valid_until_s)}`,
  ].filter(Boolean);
  const isOver = typeof shown.expires_at_s === "number" && 1000 * shown.expires_at_s < Date.now();
  return (
    <>
      <div class="row middle">
        <strong class="grow">
          {shown.name} <span class={isOver ? "state failed" : "state"}>{isOver ? "expired" : shown.scope}</span>
        </strong>
        {shown.is_configured ? (
          <span class="soft">of the configuration file</span>
        ) : (
          <>
            <button type="button" class="plain" aria-label={`New secret for ${shown.name}`} onClick={() => onOpen({ kind: "rotate", key: shown })}>
              New secret…
            </button>
            <button type="button" class="danger" aria-label={`Revoke ${shown.name}`} onClick={() => onOpen({ kind: "revoke", key: shown })}>
              Revoke…
            </button>
          </>
        )}
      </div>
      <p class="soft">
        {sites}; {typeof shown.expires_at_s === "number" ? `${isOver ? "was valid" : "valid"} until ${moment(shown.expires_at_s)}` : "valid for good"}
        {limits.map((limit) => `; ${limit}`).join("")}
      </p>
    </>
  );
}

const day = (at_s: number) => new Date(1000 * at_s).toLocaleDateString("en", { dateStyle: "medium" });
const moment = (at_s: number) => new Date(1000 * at_s).toLocaleString("en", { dateStyle: "medium", timeStyle: "short" });

function NewKey({ isFirst, onIssued }: { isFirst: boolean; onIssued: (issued: Schemas["IssuedKey"]) => void }) {
  const [name, setName] = useState("");
  const [chosenScope, setScope] = useState<Schemas["NewKey"]["scope"]>("write");
  const [sites, setSites] = useState("*");
  const [lifetime_s, setLifetime] = useState("");
  const [rate, setRate] = useState("");
  const scope = isFirst ? "admin" : chosenScope;
  const named = isFirst ? ["*"] : sites.split(/[,\s]+/).filter(Boolean);
  const make = async () => {
    const body = {
      name,
      scope,
      sites: named,
      ...(lifetime_s && { expires_in_s: Number(lifetime_s) }),
      ...(rate && { requests_per_s_max: Number(rate) }),
    };
    onIssued(await api.post("/v1/keys", { body }));
    setName("");
  };
  return (
    <Form class="card" act={make} label="New key">
      <h2>{isFirst ? "Make the first key" : "New key"}</h2>
      <div class="row top">
        <Field label="Name of the key" value={name} required maxLength={64} autocomplete="off" onInput={(event) => setName(event.currentTarget.value)} hint="who will use it; stands in the log" />
        {!isFirst && <Choice label="It may" value={scope} options={SCOPES} onChange={(value) => setScope(SCOPES.find(([known]) => known === value)?.[0] ?? "read")} />}
      </div>
      {!isFirst && (
        <div class="row top">
          <Field label="Sites" value={sites} required autocomplete="off" onInput={(event) => setSites(event.currentTarget.value)} hint="names with commas between; * means all" />
          <Choice label="Valid" value={lifetime_s} options={LIFETIMES} onChange={setLifetime} />
          <Field label="Requests a second" type="number" min={0.1} step="any" placeholder="any" value={rate} onInput={(event) => setRate(event.currentTarget.value)} hint="at most, on average" />
        </div>
      )}
      <button type="submit" class="main" disabled={!isName(name) || named.length === 0}>
        Make the key
      </button>
    </Form>
  );
}

/** Shows a secret once; the first of a server is taken up by this browser, which would be locked out without. */
function Secret({ issued, isFirst, onClose }: { issued: Schemas["IssuedKey"]; isFirst: boolean; onClose: () => void }) {
  const [isTaken, setTaken] = useState(isFirst);
  const [isCopied, setCopied] = useState(false);
  const end = () => {
    // First the key, since closing asks for the list again.
    if (isTaken) useKey(issued.secret, false);
    onClose();
  };
  return (
    <Dialog title={`Secret of ${issued.key.name}`} onClose={end}>
      <p>It is shown this once and kept nowhere. Copy it now.</p>
      <pre class="secret" tabIndex={0} aria-label="Secret">
        {issued.secret}
      </pre>
      <div class="row">
        {/* Browsers have no clipboard for pages that came without TLS from another machine. */}
        {"clipboard" in navigator && (
          <button type="button" class="plain" onClick={() => void navigator.clipboard.writeText(issued.secret).then(() => setCopied(true))}>
            Copy
          </button>
        )}
        <span role="status" class="soft">
          {isCopied ? "Copied." : ""}
        </span>
      </div>
      <Tick label="Use it in this tab from now on" isOn={isTaken} onChange={setTaken} />
      <div class="row end">
        <button type="button" class="main" onClick={end}>
          I have it
        </button>
      </div>
    </Dialog>
  );
}

function Rotation({ shown, onIssued, onClose }: { shown: Schemas["Key"]; onIssued: (issued: Schemas["IssuedKey"]) => void; onClose: () => void }) {
  const [grace_s, setGrace] = useState(String(DAY_S));
  const inUse = useCell(apiKey);
  const rotate = async () => onIssued(await api.post("/v1/keys/{key}/rotate", { path: { key: shown.name }, query: { grace_s: Number(grace_s) } }));
  return (
    <Dialog title={`New secret for ${shown.name}`} onClose={onClose}>
      <Form act={rotate}>
        <p>The key keeps its name and what it may do.{inUse ? " If it is the one of this browser, take the new secret up when it is shown." : ""}</p>
        <Choice label="The secret so far" value={grace_s} options={GRACES} onChange={setGrace} />
        <div class="row end">
          <button type="button" class="plain" onClick={onClose}>
            Cancel
          </button>
          <button type="submit" class="main">
            Make it
          </button>
        </div>
      </Form>
    </Dialog>
  );
}
