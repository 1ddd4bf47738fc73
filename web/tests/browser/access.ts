// Faults of access, as axe finds them.

import { AxeBuilder } from '@axe-core/playwright';
import { expect, type Page } from '@playwright/test';

const TAGS = ['wcag2a', 'wcag2aa', 'wcag22aa'];

/** The rules whose answer depends on colours, and so on the theme. */
const OF_COLOURS = ['color-contrast', 'link-in-text-block'];
/** The rules whose answer depends on sizes and places, and so on the size of the screen. */
const OF_SIZES = ['target-size', 'scrollable-region-focusable'];

/** The rules to ask: all, or those alone that can answer differently in another theme or at another size. */
export type Rules = 'all' | 'of colours' | 'of sizes';

/** `words` name the state in which the page is. The page has no frames, so that axe need not look for any. */
export async function expectNoFaults(page: Page, words: string, rules: Rules = 'all'): Promise<void> {
  const axe = new AxeBuilder({ page }).setLegacyMode();
  if (rules === 'all') axe.withTags(TAGS);
  else axe.withRules(rules === 'of colours' ? OF_COLOURS : OF_SIZES);
  const { violations } = await axe.analyze();
  const found = violations.map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.html).join(' ')}`);
  expect(found, `${words}, rules ${rules}`).toEqual([]);
}

/** Nothing is wider than the screen. */
export async function expectNothingWider(page: Page): Promise<void> {
  await expect
    .poll(() => page.evaluate(() => document.documentElement.scrollWidth - innerWidth))
    .toBeLessThanOrEqual(0);
}

/** Sizes of screens: one column and two, and a column too narrow for long words. */
export const SIZES = [
  ['wide', 1280, 720],
  ['tablet', 820, 1180],
  ['phone', 390, 844],
] as const;

type Theme = 'dark' | 'light';

/**
 * What is checked at each size. The tablet shows the parts of the wide screen in one column; the phone hides some
 * of them and shows others, so that all rules are asked there again.
 */
const CHECKS: Record<(typeof SIZES)[number][0], [Theme, Rules][]> = {
  wide: [
    ['dark', 'all'],
    ['light', 'of colours'],
  ],
  tablet: [['dark', 'of sizes']],
  phone: [
    ['dark', 'all'],
    ['light', 'of colours'],
  ],
};

/** Checks the state that the page shows now, with what matters at this size. */
export async function checkAt(page: Page, size: (typeof SIZES)[number][0], words: string): Promise<void> {
  for (const [theme, rules] of CHECKS[size]) {
    await page.emulateMedia({ colorScheme: theme });
    await expect(page.locator('html')).toHaveAttribute('data-theme', theme);
    await expectNoFaults(page, `${words}, ${size}, ${theme}`, rules);
  }
  await expectNothingWider(page);
}
