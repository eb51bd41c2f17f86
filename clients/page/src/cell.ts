// Values that parts of the page share, and the hooks that read them.

import { useCallback, useEffect, useRef, useState } from "preact/hooks";

/** A value that tells when it changes. */
export class Cell<T> {
  private readonly listeners = new Set<() => void>();

  constructor(private value: T) {}

  get(): T {
    return this.value;
  }

  set(value: T): void {
    if (Object.is(value, this.value)) return;
    this.value = value;
    for (const listener of [...this.listeners]) listener();
  }

  /** Calls `listener` after every change until the answer is called. */
  watch(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
}

/** The value of a cell; the component is drawn again when it changes. */
export function useCell<T>(cell: Cell<T>): T {
  const [, redraw] = useState(0);
  useEffect(() => cell.watch(() => redraw((count) => count + 1)), [cell]);
  return cell.get();
}

/** What became of a request. */
export interface Loaded<T> {
  value: T | undefined;
  error: unknown;
  isLoading: boolean;
  reload: () => void;
}

/** Loads a value, and again when `key` changes; an answer that comes too late is dropped. */
export function useLoaded<T>(load: (signal: AbortSignal) => Promise<T>, key: string): Loaded<T> {
  const [state, setState] = useState<{ key: string; value?: T; error?: unknown; isLoading: boolean }>({
    key,
    isLoading: true,
  });
  const [round, setRound] = useState(0);
  const newest = useRef(load);
  newest.current = load;
  useEffect(() => {
    const abort = new AbortController();
    setState((old) => (old.key === key ? { ...old, isLoading: true } : { key, isLoading: true }));
    newest.current(abort.signal).then(
      (value) => !abort.signal.aborted && setState({ key, value, isLoading: false }),
      (error: unknown) => !abort.signal.aborted && setState({ key, error, isLoading: false }),
    );
    return () => abort.abort();
  }, [key, round]);
  const reload = useCallback(() => setRound((count) => count + 1), []);
  const isCurrent = state.key === key;
  return {
    value: isCurrent ? state.value : undefined,
    error: isCurrent ? state.error : undefined,
    isLoading: !isCurrent || state.isLoading,
    reload,
  };
}

/** Something a button starts. */
export interface Action<A extends unknown[]> {
  run: (...parameters: A) => Promise<void>;
  isRunning: boolean;
  error: unknown;
  forget: () => void;
}

/** Runs what a button starts, one at a time, and keeps what went wrong. */
export function useAction<A extends unknown[]>(act: (...parameters: A) => Promise<unknown>): Action<A> {
  const [state, setState] = useState<{ isRunning: boolean; error?: unknown }>({ isRunning: false });
  const newest = useRef(act);
  newest.current = act;
  const isBusy = useRef(false);
  const run = useCallback(async (...parameters: A) => {
    if (isBusy.current) return;
    isBusy.current = true;
    setState({ isRunning: true });
    try {
      await newest.current(...parameters);
      setState({ isRunning: false });
    } catch (error) {
      setState({ isRunning: false, error });
    } finally {
      isBusy.current = false;
    }
  }, []);
  const forget = useCallback(() => setState({ isRunning: false }), []);
  return { run, isRunning: state.isRunning, error: state.error, forget };
}

/** Calls `ask` every so often while the page is looked at; not again before the last call is through. */
export function useRepeated(ask: () => Promise<void>, period_ms: number): void {
  const newest = useRef(ask);
  newest.current = ask;
  useEffect(() => {
    let timer: number | undefined;
    let isOver = false;
    const round = async () => {
      if (document.visibilityState === "visible") await newest.current().catch(() => undefined);
      if (!isOver) timer = window.setTimeout(round, period_ms);
    };
    timer = window.setTimeout(round, period_ms);
    return () => {
      isOver = true;
      window.clearTimeout(timer);
    };
  }, [period_ms]);
}
