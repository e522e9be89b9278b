// A page of the viewer, as a user has it.
import assert from "node:assert/strict";
import { join } from "node:path";
import { isFirefox, kShots } from "./program.mjs";

const kPatience = 30000;

export class LookPage {
  faults = [];

  static async open(test, browser, address, { width = 1000, height = 620, scheme = "dark", isPhone = false, isDownloading = false, folder } = {}) {
    const context = await browser.createBrowserContext(isDownloading ? { downloadBehavior: { policy: "allow", downloadPath: folder } } : {});
    const look = new LookPage();
    look.tab = await context.newPage();
    look.tab.setDefaultTimeout(kPatience);
    look.tab.on("pageerror", (error) => look.faults.push(error.stack));
    look.tab.on("request", (request) => {
      if (!/^(http:\/\/127\.0\.0\.1:|data:|blob:)/.test(request.url())) look.faults.push(`asked the network for ${request.url()}`);
    });
    await look.tab.setViewport(isFirefox ? { width, height } : { width, height, hasTouch: isPhone, isMobile: isPhone });
    if (!isFirefox) await look.tab.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
    await look.tab.goto(address);
    await look.finished();
    test.after(async () => {
      await context.close();
      assert.deepEqual(look.faults, []);
    });
    return look;
  }

  /** Until the last picture of the settings as they are is shown. */
  async finished() {
    await this.tab.waitForFunction(() => document.getElementById("stage").getAttribute("aria-busy") === "false" && document.getElementById("picture").dataset.revision);
  }

  /** Until `text` matches what the element says. */
  async says(selector, text) {
    await this.tab.waitForFunction((where, source) => new RegExp(source).test(document.querySelector(where)?.textContent ?? ""), {}, selector, text.source);
  }

  text(selector) {
    return this.tab.$eval(selector, (element) => element.textContent);
  }

  value(selector) {
    return this.tab.$eval(selector, (element) => element.value);
  }

  /** Types into the text of a control and leaves it. */
  async type(selector, text) {
    await this.tab.$eval(selector, (element) => element.closest("details")?.setAttribute("open", ""));
    await this.tab.focus(selector);
    await this.tab.$eval(selector, (element) => element.select());
    if (text) await this.tab.keyboard.type(text);
    else await this.tab.keyboard.press("Backspace");
    await this.tab.keyboard.press("Tab");
  }

  /** Mean red, green and blue of what the canvas shows between shares of its width. */
  mean(from = 0, to = 1) {
    return this.tab.$eval(
      "#picture",
      (canvas, begin, end) => {
        const left = Math.round(canvas.width * begin), width = Math.round(canvas.width * end) - left;
        const pixels = canvas.getContext("2d").getImageData(left, 0, width, canvas.height).data;
        const sums = [0, 0, 0];
        for (let i = 0; i < pixels.length; i += 4) for (let c = 0; c < 3; c++) sums[c] += pixels[i + c];
        return sums.map((sum) => (4 * sum) / pixels.length);
      },
      from,
      to,
    );
  }

  /** All pixels at a twentieth of the size, to compare. */
  small() {
    return this.tab.$eval("#picture", (canvas) => {
      const small = document.createElement("canvas");
      small.width = 40;
      small.height = 30;
      const context = small.getContext("2d");
      context.drawImage(canvas, 0, 0, 40, 30);
      return [...context.getImageData(0, 0, 40, 30).data];
    });
  }

  /** The middle of an element in the window. */
  async middle(selector) {
    return this.tab.$eval(selector, (element) => {
      const { left, top, width, height } = element.getBoundingClientRect();
      return { x: left + width / 2, y: top + height / 2, width, height };
    });
  }

  async drag(from, to, { steps = 8, pause = 20 } = {}) {
    const { mouse } = this.tab;
    await mouse.move(from.x, from.y);
    await mouse.down();
    for (let i = 1; i <= steps; i++) {
      await mouse.move(from.x + ((to.x - from.x) * i) / steps, from.y + ((to.y - from.y) * i) / steps);
      await new Promise((done) => setTimeout(done, pause));
    }
    await mouse.up();
  }

  async settings() {
    await new Promise((done) => setTimeout(done, 400));
    const fragment = await this.tab.evaluate(() => location.hash.slice(1));
    return JSON.parse(Buffer.from(fragment, "base64url").toString());
  }

  async screenshot(name) {
    await this.tab.screenshot({ path: join(kShots, `${name}.png`) });
    await this.tab.screenshot({ path: join(kShots, `${name}.jpg`), type: "jpeg", quality: 85 });
  }
}

/** Largest difference of mean colours. */
export const apart = (a, b) => Math.max(...a.map((x, i) => Math.abs(x - b[i])));

/** Mean difference of what small() gave. */
export const difference = (a, b) => a.reduce((sum, x, i) => sum + Math.abs(x - b[i]), 0) / a.length;
