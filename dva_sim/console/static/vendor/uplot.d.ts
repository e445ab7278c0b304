/** As much of uPlot as the console uses. */
export default class uPlot {
  constructor(options: object, data: number[][], where: HTMLElement);
  setData(data: number[][]): void;
  setSize(size: { width: number; height: number }): void;
  destroy(): void;
}
