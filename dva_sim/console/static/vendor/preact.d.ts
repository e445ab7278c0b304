/** As much of Preact, its signals and htm as the console uses. */
export type Signal<T> = { value: T; peek(): T };
export type ReadonlySignal<T> = { readonly value: T; peek(): T };
export function signal<T>(value: T): Signal<T>;
export function computed<T>(read: () => T): ReadonlySignal<T>;
export function effect(run: () => void | (() => void)): () => void;
export function batch<T>(run: () => T): T;
export function html(strings: TemplateStringsArray, ...values: unknown[]): any;
export function render(node: unknown, where: Element): void;
export function useEffect(run: () => void | undefined | (() => void), inputs?: unknown[]): void;
export function useLayoutEffect(run: () => void | undefined | (() => void), inputs?: unknown[]): void;
export function useMemo<T>(make: () => T, inputs: unknown[]): T;
export function useRef<T>(first: T): { current: T };
export function useState<T>(first: T): [T, (next: T | ((old: T) => T)) => void];
