// Small parts that all views are made of.

import type { ComponentChildren, JSX } from "preact";
import { useEffect, useId, useRef, useState } from "preact/hooks";
import { wordsOf } from "./api";
import { useAction } from "./cell";

/** Something that went wrong, read out when it appears. */
export function Alert({ error }: { error: unknown }) {
  if (error === undefined || error === null) return null;
  return (
    <p class="alert" role="alert">
      {wordsOf(error)}
    </p>
  );
}

/** A button that runs something, cannot be pressed meanwhile, and shows below what went wrong. */
export function Act(props: {
  act: () => Promise<unknown>;
  children: ComponentChildren;
  kind?: "main" | "danger" | "plain";
  isDisabled?: boolean;
  title?: string;
}) {
  const action = useAction(props.act);
  return (
    <>
      <button
        type="button"
        class={props.kind ?? "plain"}
        title={props.title}
        disabled={props.isDisabled || action.isRunning}
        aria-busy={action.isRunning}
        onClick={() => void action.run()}
      >
        {props.children}
      </button>
      <Alert error={action.error} />
    </>
  );
}

/** A form that does not leave the page. */
export function Form(props: { act: () => Promise<unknown>; children: ComponentChildren; class?: string; label?: string }) {
  const action = useAction(props.act);
  return (
    <form
      class={props.class}
      aria-label={props.label}
      aria-busy={action.isRunning}
      onSubmit={(event) => {
        event.preventDefault();
        void action.run();
      }}
    >
      {props.children}
      <Alert error={action.error} />
    </form>
  );
}

/** A labeled field. */
export function Field(props: { label: string; hint?: string; isHidden?: boolean } & JSX.IntrinsicElements["input"]) {
  const { label, hint, isHidden, ...rest } = props;
  const id = useId();
  return (
    <div class="field">
      <label for={id} class={isHidden ? "unseen" : undefined}>
        {label}
      </label>
      <input id={id} {...rest} aria-describedby={hint ? `${id}-hint` : undefined} />
      {hint && (
        <small id={`${id}-hint`} class="soft">
          {hint}
        </small>
      )}
    </div>
  );
}

/** A field whose text counts when it is left; what is typed stays while the rest of the page is drawn anew. */
export function LazyField({ value, onCommit, ...rest }: { label: string; hint?: string; value: string; onCommit: (text: string) => void } & Omit<JSX.IntrinsicElements["input"], "value" | "label">) {
  const [draft, setDraft] = useState<string | undefined>();
  return (
    <Field
      {...rest}
      value={draft ?? value}
      onInput={(event) => setDraft(event.currentTarget.value)}
      onChange={(event) => {
        setDraft(undefined);
        onCommit(event.currentTarget.value);
      }}
    />
  );
}

/** A labeled choice. */
export function Choice(props: {
  label: string;
  value: string;
  options: readonly (readonly [string, string])[];
  onChange: (value: string) => void;
  isHidden?: boolean;
}) {
  const id = useId();
  return (
    <div class="field">
      <label for={id} class={props.isHidden ? "unseen" : undefined}>
        {props.label}
      </label>
      <select id={id} value={props.value} onChange={(event) => props.onChange(event.currentTarget.value)}>
        {props.options.map(([value, text]) => (
          <option key={value} value={value} selected={value === props.value}>
            {text}
          </option>
        ))}
      </select>
    </div>
  );
}

/** A box to tick. */
export function Tick(props: { label: ComponentChildren; isOn: boolean; onChange: (isOn: boolean) => void; swatch?: string; isDisabled?: boolean }) {
  return (
    <label class="tick">
      <input type="checkbox" checked={props.isOn} disabled={props.isDisabled} onChange={(event) => props.onChange(event.currentTarget.checked)} />
      {props.swatch && <Swatch color={props.swatch} />}
      <span>{props.label}</span>
    </label>
  );
}

export function Swatch({ color, dash }: { color: string; dash?: number[] }) {
  return (
    <svg class="swatch" viewBox="0 0 18 12" aria-hidden="true">
      {dash ? <path d="M0 6h18" stroke={color} stroke-width="3" stroke-dasharray={dash.join(" ")} /> : <rect x="3" width="12" height="12" rx="3" fill={color} />}
    </svg>
  );
}

export function Progress({ value, label }: { value: number; label: string }) {
  return (
    <div class="progress">
      <progress value={value} max={1} aria-label={label} />
      <span class="soft">{label}</span>
    </div>
  );
}

/** Asks before something is done that cannot be undone; a name may have to be typed for it. */
export function Confirm(props: {
  title: string;
  children: ComponentChildren;
  word?: string;
  verb: string;
  act: () => Promise<unknown>;
  onClose: () => void;
}) {
  const [typed, setTyped] = useState("");
  const action = useAction(async () => {
    await props.act();
    props.onClose();
  });
  return (
    <Dialog title={props.title} onClose={props.onClose}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          void action.run();
        }}
      >
        {props.children}
        {props.word && (
          <Field label={`Type ${props.word} to confirm`} value={typed} autocomplete="off" onInput={(event) => setTyped(event.currentTarget.value)} />
        )}
        <Alert error={action.error} />
        <div class="row end">
          <button type="button" class="plain" onClick={props.onClose}>
            Keep it
          </button>
          <button type="submit" class="danger" disabled={action.isRunning || (props.word !== undefined && typed !== props.word)}>
            {props.verb}
          </button>
        </div>
      </form>
    </Dialog>
  );
}

/** A window over the page; the browser keeps the focus inside. */
export function Dialog(props: { title: string; children: ComponentChildren; onClose: () => void }) {
  const dialog = useRef<HTMLDialogElement>(null);
  const isGone = useRef(false);
  const id = useId();
  useEffect(() => {
    const shown = dialog.current;
    shown?.showModal();
    return () => {
      isGone.current = true;
      shown?.close();
    };
  }, []);
  // The browser tells of the end also when another window has already taken the place of this one.
  const close = () => {
    if (!isGone.current) props.onClose();
  };
  return (
    <dialog ref={dialog} aria-labelledby={id} onCancel={close} onClose={close}>
      <h2 id={id}>{props.title}</h2>
      {props.children}
    </dialog>
  );
}

/** A link to a view. */
export function Go(props: { to: string; children: ComponentChildren; class?: string; isCurrent?: boolean; title?: string }) {
  return (
    <a href={props.to} class={props.class} title={props.title} aria-current={props.isCurrent ? "page" : undefined}>
      {props.children}
    </a>
  );
}

/** A figure with what it is. */
export function Figures({ figures }: { figures: readonly (readonly [string, ComponentChildren])[] }) {
  return (
    <dl class="figures">
      {figures.map(([name, value]) => (
        <div key={name}>
          <dt>{name}</dt>
          <dd>{value}</dd>
        </div>
      ))}
    </dl>
  );
}

export const count = (value: number) => value.toLocaleString("en");
/** A share; one that is nearly all is not called all. */
export const percent = (value: number) => {
  const share = 100 * value;
  if (share >= 99.95 && share < 100) return "> 99.9 %";
  return `${share > 99 && share < 100 ? share.toFixed(1) : Math.round(share)} %`;
};
/** A probability, which is never certain. */
export const probability = (value: number) => (value >= 0.9995 ? "> 99.9 %" : value < 0.001 ? "< 0.1 %" : percent(value));
export const metres = (value: number) =>
  Math.abs(value) >= 100 ? `${count(Math.round(value))} m` : Math.abs(value) >= 1 ? `${value.toFixed(1)} m` : value === 0 ? "0 m" : `${(100 * value).toFixed(1)} cm`;
export const degrees = (angle_rad: number) => `${((180 / Math.PI) * angle_rad).toFixed(Math.abs(angle_rad) < 0.17 ? 1 : 0)}°`;
export const bytes = (value: number) => (value < 1e6 ? `${Math.ceil(value / 1e3)} kB` : `${(value / 1e6).toFixed(1)} MB`);
/** One thing or several. */
export const many = (value: number, one: string, several = `${one}s`) => `${count(value)} ${value === 1 ? one : several}`;
