import { useSignal } from '@preact/signals';
import { useEffect } from 'preact/hooks';

/** Seconds since `since`, counted on. They are not read out each second. */
export function Seconds({ since }: { since: number }) {
  const now = useSignal(Date.now());
  useEffect(() => {
    const timer = setInterval(() => (now.value = Date.now()), 1000);
    return () => clearInterval(timer);
  }, []);
  return <span aria-hidden="true">{Math.max(0, Math.round((now.value - since) / 1000))}</span>;
}
