/** The scan: plan, progress, and the map that grows sharper with every stop. */
export function ScanView() {
  return <main class="scan" />;
}
