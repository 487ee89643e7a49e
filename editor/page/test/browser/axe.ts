import axe from "axe-core";
import type { Page } from "playwright-core";

/** What axe-core finds wrong on a page as it is shown now, and where. The page's policy allows no script of others. */
export async function found_by_axe(page: Page): Promise<string[]> {
  const session = await page.context().newCDPSession(page);
  await session.send("Runtime.evaluate", { expression: axe.source });
  const results = await page.evaluate(() => (globalThis as unknown as { axe: typeof axe }).axe.run());
  return results.violations.map((found) => `${found.id}: ${found.nodes.map((node) => `${node.html} ${node.failureSummary}`).join(" | ")}`);
}
