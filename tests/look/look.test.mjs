// What a user does on the viewer's page, in a browser, with the program. Expected are changes of what the canvas shows, by what the option
// that is changed means: a sun behind darkens the front, exposure +2 brightens, other settings than these keep the picture.
import assert from "node:assert/strict";
import { copyFileSync, existsSync, readdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { apart, difference, LookPage } from "./page.mjs";
import { folderFor, kRoot, kSmall, startBrowser, startProgram, startWire } from "./program.mjs";

// Models that the repository makes; where they are, pictures for docs/ are of them.
const kExamples = [join(kRoot, "build/examples"), join(kRoot, "examples")].find((folder) => existsSync(join(folder, "whale.obj")));
const kLimit = { timeout: 90000 };
// JPEG at another quality or level is nearer than this; what changes is farther.
const kSame = 3;

let browser;
before(async () => {
  browser = await startBrowser();
});
after(() => browser?.close());

function startCloud(t, folder) {
  copyFileSync(join(kRoot, "data/cloud_base.obj"), join(folder, "cloud_base.obj"));
  return startProgram(t, ["cloud_base.obj", ...kSmall], folder);
}

async function cloud(t, options = {}) {
  const folder = folderFor(t);
  const program = await startCloud(t, folder);
  return { folder, program, look: await LookPage.open(t, browser, program.address, { ...options, folder }) };
}

describe("a cloud", () => {
  test("is shown, with its controls", kLimit, async (t) => {
    const { look } = await cloud(t, { width: 1440, height: 860 });
    assert.match(await look.text("#input"), /cloud_base\.obj/);
    const [red, green, blue] = await look.mean();
    assert.ok(blue > red + 5 && red > 20 && green > 20, `${[red, green, blue]} is no cloud in a blue sky`);
    assert.match(await look.text("#facts"), /\d+ × \d+ .* rays? per pixel/);
    assert.ok((await look.tab.$$(".control")).length > 60);
    const open = await look.tab.$$eval("details", (all) => all.filter((one) => one.open).map((one) => one.dataset.name));
    assert.ok(open.includes("Shape") && !open.some((name) => name.startsWith("More")), String(open));
    const nameless = await look.tab.$$eval("button, input, select, textarea", (all) =>
      all.filter((one) => !one.labels?.length && !one.getAttribute("aria-label") && !one.textContent.trim()).map((one) => one.outerHTML),
    );
    assert.deepEqual(nameless, []);
    await look.screenshot("open_dark");
  });

  test("is finished only once its last picture is seen, however long that takes to decode", kLimit, async (t) => {
    const { look } = await cloud(t);
    await look.tab.evaluate(() => {
      const decode = window.createImageBitmap;
      window.createImageBitmap = async (...all) => {
        await new Promise((done) => setTimeout(done, 1000));
        return decode(...all);
      };
    });
    const revision = Number(await look.tab.$eval("#picture", (canvas) => canvas.dataset.revision));
    await look.type("#render-exposure", "2");
    await look.finished();
    assert.ok(Number(await look.tab.$eval("#picture", (canvas) => canvas.dataset.revision)) > revision);
    const bright = await look.small();
    await new Promise((done) => setTimeout(done, 1500));
    assert.equal(difference(bright, await look.small()), 0);
  });

  test("is orbited by a drag, and the picture follows", kLimit, async (t) => {
    const { look } = await cloud(t);
    const before = await look.small();
    const revision = Number(await look.tab.$eval("#picture", (canvas) => canvas.dataset.revision));
    const { x, y } = await look.middle("#picture");
    await look.drag({ x: x - 120, y }, { x: x + 120, y: y + 30 }, { steps: 24, pause: 40 });
    await look.finished();
    assert.ok(difference(before, await look.small()) > kSame);
    const shown = Number(await look.tab.$eval("#picture", (canvas) => canvas.dataset.revision));
    assert.ok(shown > revision + 2, `only ${shown - revision} pictures`);
    const { settings } = await look.settings();
    assert.match(settings.render["camera-position"], /^-?[\d.]+,-?[\d.]+,-?[\d.]+$/);
    await look.screenshot("dragged");
    await look.tab.keyboard.press("f");
    await look.finished();
    assert.match((await look.settings()).settings.render.view, /^-?[\d.]+,-?[\d.]+$/);
  });

  test("is moved by wheel and keys, and shown from the front", kLimit, async (t) => {
    const { look } = await cloud(t);
    const { x, y } = await look.middle("#picture");
    const far = await look.small();
    await look.tab.mouse.move(x, y);
    for (let i = 0; i < 4; i++) await look.tab.mouse.wheel({ deltaY: -200 });
    await look.tab.waitForFunction(() => location.hash.length > 1);
    await look.finished();
    const near = await look.small();
    assert.ok(difference(far, near) > kSame);
    await look.tab.focus("#picture");
    for (let i = 0; i < 4; i++) await look.tab.keyboard.press("ArrowLeft");
    await look.settings();
    await look.finished();
    assert.ok(difference(near, await look.small()) > kSame);
    await look.tab.click("[data-view='0,0']");
    await look.finished();
    assert.equal((await look.settings()).settings.render.view, "0,0");
    await look.tab.mouse.move(x, y);
    await look.says("#pixel", /R \d/);
  });

  test("grows with a slider; undo and redo bring pictures back", kLimit, async (t) => {
    const { look } = await cloud(t);
    const before = await look.small();
    const { x, y, width } = await look.middle("[data-name=amplitude] input[type=range]");
    await look.drag({ x: x - width / 4, y }, { x: x + width / 4, y });
    await look.finished();
    const amplitude = await look.value("#cloud-amplitude");
    assert.match(amplitude, /^[5-9](\.\d+)?%$/);
    const grown = await look.small();
    assert.ok(difference(before, grown) > kSame);
    await look.screenshot("slid");
    await look.tab.focus("#picture");
    await look.tab.keyboard.down("Control");
    await look.tab.keyboard.press("z");
    await look.tab.keyboard.up("Control");
    await look.finished();
    assert.equal(await look.value("#cloud-amplitude"), "2.5%");
    assert.ok(difference(before, await look.small()) < kSame);
    await look.tab.click("#redo");
    await look.finished();
    assert.equal(await look.value("#cloud-amplitude"), amplitude);
    assert.ok(difference(grown, await look.small()) < kSame);
    const label = await look.middle("[data-name=amplitude] label");
    await look.tab.mouse.click(label.x, label.y, { count: 2 });
    await look.finished();
    assert.equal(await look.value("#cloud-amplitude"), "2.5%");
  });

  test("is lit by a sun on the dome, and compared with what was pinned", kLimit, async (t) => {
    const { look } = await cloud(t);
    const left = await look.mean(0, 0.4), right = await look.mean(0.6, 1);
    await look.tab.keyboard.press("p");
    const dome = await look.middle("#dome");
    await look.drag({ x: dome.x + 20, y: dome.y + 20 }, { x: dome.x - 5, y: dome.y - dome.height * 0.38 });
    await look.finished();
    assert.match((await look.settings()).settings.render.sun[0], /^\d+,\d/);
    assert.ok(apart(left, await look.mean(0, 0.4)) < kSame);
    assert.ok(apart(right, await look.mean(0.6, 1)) > kSame);
    await look.screenshot("split");
    const divider = await look.middle("#divider");
    await look.drag({ x: divider.x, y: divider.y }, { x: divider.x - divider.x * 0.8, y: divider.y });
    assert.ok(apart(left, await look.mean(0.15, 0.4)) > kSame);
    await look.tab.keyboard.press("b");
    assert.equal(await look.tab.$eval("#divider", (divider_) => divider_.hidden), true);
  });

  test("is exposed, shown in false colours and layer by layer, and as a surface", kLimit, async (t) => {
    const { look } = await cloud(t);
    const [before] = await look.mean();
    await look.type("#render-exposure", "2");
    await look.finished();
    assert.ok((await look.mean())[0] > before + 20);
    const beauty = await look.small();
    for (const [selector, value, name] of [["#layer", "normal", "normal"], ["#layer", "depth", "depth"], ["#what", "surface", "surface"]]) {
      await look.tab.select(selector, value);
      await look.finished();
      assert.ok(difference(beauty, await look.small()) > kSame, name);
      await look.screenshot(`layer_${name}`);
      await look.tab.select(selector, selector === "#what" ? "cloud" : "beauty");
      await look.finished();
    }
    await look.tab.click("#false-color");
    await look.finished();
    assert.ok(difference(beauty, await look.small()) > kSame);
    await look.screenshot("false_colour");
  });

  test("is ramped by height", kLimit, async (t) => {
    const { look } = await cloud(t);
    const before = await look.small();
    await look.tab.click("[data-name=amplitude] .curve");
    const point = await look.middle("[data-name=amplitude] circle:last-of-type");
    await look.drag(point, { x: point.x, y: point.y - 60 });
    await look.finished();
    assert.match(await look.value("#cloud-amplitude"), /^height:0=2\.5%,1=[4-9]/);
    assert.ok(difference(before, await look.small()) > 1);
    await look.screenshot("ramp");
  });

  test("stands beside itself in a wedge, and one is taken", kLimit, async (t) => {
    const { look } = await cloud(t);
    await look.tab.click("#open-wedge");
    await look.type(".axis input", "1%, 6%");
    await look.tab.click("#wedge-make");
    await look.says("#wedge-state", /Click/);
    assert.equal((await look.tab.$$("#wedge-sheet img")).length, 2);
    await look.screenshot("wedge");
    await look.tab.click("#wedge-sheet button:nth-child(2)");
    await look.finished();
    assert.equal(await look.value("#cloud-amplitude"), "6%");
  });

  test("comes out as command line, recipe, look and volume", kLimit, async (t) => {
    const { look, folder } = await cloud(t, { isDownloading: true });
    await look.type("#cloud-billow", "0.8");
    await look.finished();
    await look.tab.click("#open-out");
    await look.says("#out-lines", /nephele cloud .*--billow[= ]0\.8[^]*nephele render/);
    await look.tab.click("#out-recipe");
    const recipe = join(folder, "cloud.toml");
    for (let i = 0; i < 100 && !existsSync(recipe); i++) await new Promise((done) => setTimeout(done, 100));
    assert.match(readFileSync(recipe, "utf8"), /\[cloud\][^]*billow = "0\.8"/);
    await look.tab.click("[data-job-of=vdb]");
    await look.says(".job[data-state=done]", /Done/);
    assert.ok(statSync(join(folder, "cloud.vdb")).size > 10000);
    await look.screenshot("export");
    await look.tab.click("#out .close");
    await look.tab.click("#open-looks");
    await look.tab.waitForFunction(() => document.querySelector("[data-look=storm] img")?.naturalWidth === 240);
    await look.tab.type("#look-name", "mine");
    await look.tab.click("#look-save");
    await look.tab.waitForSelector("[data-look=mine]");
    assert.deepEqual(readdirSync(join(folder, "config/nephele/looks")), ["mine.json"]);
    await look.screenshot("looks");
    await look.tab.click("#looks .close");
    await look.type("#cloud-billow", "0");
    await look.type("#render-exposure", "-1");
    await look.finished();
    await look.tab.click("#open-looks");
    await look.tab.waitForSelector("[data-look=mine]");
    await look.tab.click("[data-look=mine]");
    await look.finished();
    assert.equal(await look.value("#cloud-billow"), "0.8");
    assert.equal(await look.value("#render-exposure"), "0");
    assert.equal(await look.value("#cloud-resolution"), kSmall[1]);
    // Four fine layers take their time.
    if (!process.env.RESOLUTION) return;
    await look.tab.click("#open-looks");
    await look.tab.waitForSelector("[data-look=sunset]");
    await look.tab.click("[data-look=sunset]");
    await look.finished();
    await look.screenshot("look_sunset");
  });

  test("stays as it was under a bad value, and the sentence stands beside its control", kLimit, async (t) => {
    const { look } = await cloud(t);
    const before = await look.small();
    await look.type("#cloud-amplitude", "thick");
    await look.says("[data-name=amplitude] .error", /amplitude.*thick/);
    assert.equal(await look.tab.$eval("#cloud-amplitude", (input) => input.getAttribute("aria-invalid")), "true");
    assert.ok(difference(before, await look.small()) < kSame);
    await look.screenshot("bad_value");
    await look.type("#cloud-amplitude", "");
    await look.says("[data-name=amplitude] .error", /^$/);
    await look.finished();
  });

  test("lets go what needs what is taken away, and keeps defaults that are typed", kLimit, async (t) => {
    const { look } = await cloud(t);
    const { x, y } = await look.middle("#picture");
    await look.drag({ x, y }, { x: x + 60, y });
    await look.finished();
    await look.type("#render-view", "90,10");
    await look.finished();
    assert.equal(await look.tab.$eval("#banner", (banner) => banner.hidden), true);
    assert.equal(await look.value("#render-look-at"), "");
    const isSet = () => look.tab.$eval("[data-name=amplitude]", (control) => control.classList.contains("changed"));
    assert.equal(await isSet(), false);
    await look.type("#cloud-amplitude", "3%");
    await look.type("#cloud-amplitude", "2.5%");
    await look.finished();
    assert.equal(await isSet(), true);
    const label = await look.middle("[data-name=amplitude] label");
    await look.tab.mouse.click(label.x, label.y, { count: 2 });
    await look.finished();
    assert.equal(await isSet(), false);
  });

  test("is the same behind its link, and other pages stay apart", kLimit, async (t) => {
    const { look, program } = await cloud(t);
    await look.type("#cloud-amplitude", "6");
    await look.finished();
    await look.settings();
    const link = await look.tab.evaluate(() => location.href);
    const first = await look.small();
    const other = await LookPage.open(t, browser, link);
    assert.equal(await other.value("#cloud-amplitude"), "6%");
    assert.ok(difference(first, await other.small()) < kSame);
    await Promise.all([other.type("#render-exposure", "2.5"), look.type("#cloud-amplitude", "2")]);
    await Promise.all([other.finished(), look.finished()]);
    assert.equal(await look.value("#render-exposure"), "0");
    assert.equal(await other.value("#cloud-amplitude"), "6%");
    assert.ok((await other.mean())[0] > (await look.mean())[0] + 20);
    assert.ok(program.child.exitCode === null);
  });

  test("is found by the search, and all else too", kLimit, async (t) => {
    const { look } = await cloud(t, { scheme: "light", width: 1440, height: 860 });
    await look.screenshot("open_light");
    await look.tab.focus("#picture");
    await look.tab.keyboard.press("/");
    await look.tab.keyboard.type("lacunarity");
    const seen = await look.tab.$$eval(".control", (all) => all.filter((one) => one.getClientRects().length).map((one) => one.dataset.name));
    assert.deepEqual(seen, ["lacunarity"]);
    await look.screenshot("search");
    await look.tab.keyboard.press("Escape");
    await look.tab.$eval("#search", (input) => {
      input.value = "";
      input.dispatchEvent(new Event("input"));
    });
    assert.equal(await look.tab.$eval("details[data-name^=More]", (group) => group.open), false);
  });

  test("fits a phone, and a finger turns it", kLimit, async (t) => {
    const { look } = await cloud(t, { width: 390, height: 844, isPhone: true, scheme: "light" });
    assert.equal(await look.tab.evaluate(() => document.documentElement.scrollWidth), 390);
    const before = await look.small();
    const { x, y } = await look.middle("#picture");
    const finger = await look.tab.touchscreen.touchStart(x - 80, y);
    for (let i = 1; i <= 8; i++) await finger.move(x - 80 + i * 20, y);
    await finger.end();
    await look.finished();
    assert.ok((await look.settings()).settings.render["camera-position"]);
    assert.ok(difference(before, await look.small()) > kSame);
    await look.screenshot("phone");
  });
});

describe("surfaces", () => {
  test("a mesh is cut, and a slider moves its pieces apart", kLimit, async (t) => {
    const folder = folderFor(t);
    const mesh = kExamples ? join(kExamples, "hare.obj") : join(kRoot, "data/cloud_base.obj");
    const program = await startProgram(t, [mesh, "--show", "pieces", "--random-planes", "6"], folder);
    const look = await LookPage.open(t, browser, program.address, { width: 1200, height: 700 });
    assert.equal(await look.value("#what"), "pieces");
    const names = await look.tab.$$eval(".control", (all) => all.filter((one) => !one.hidden).map((one) => `${one.dataset.verb} ${one.dataset.name}`));
    assert.ok(names.includes("cut random-planes") && names.includes("render fov"), String(names));
    assert.ok(!names.some((name) => name.startsWith("cloud ") || name === "render sun"), String(names));
    assert.equal(await look.tab.$eval("#dome", (dome) => dome.getClientRects().length), 0);
    const before = await look.small();
    const { x, y, width } = await look.middle("[data-name=explode] input[type=range]");
    await look.drag({ x: x - 0.3 * width, y }, { x: x - 0.15 * width, y });
    await look.finished();
    assert.match(await look.value("#cut-explode"), /^0\.[67]\d*$/);
    const apart_ = await look.small();
    assert.ok(difference(before, apart_) > kSame);
    await look.tab.mouse.move(200, 300);
    await look.screenshot("pieces");
    await look.type("#cut-random-planes", "2");
    await look.finished();
    assert.ok(difference(apart_, await look.small()) > kSame);
    await look.tab.click("#open-out");
    await look.says("#out-lines", /nephele cut .*--random-planes=2/);
    await look.tab.click("[data-job-of=pieces]");
    await look.says(".job[data-state=done]", /Done/);
    assert.ok(existsSync(join(folder, "pieces/piece_0002.obj")));
    await look.tab.click("#out .close");
    await look.tab.select("#what", "cloud");
    await look.finished();
    assert.ok(await look.tab.$eval("#dome", (dome) => dome.getClientRects().length > 0));
    await look.tab.click("#undo");
    await look.finished();
    assert.equal(await look.value("#what"), "pieces");
  });

  test("texture coordinates are carried to another mesh, and both turn in their places", kLimit, async (t) => {
    const folder = folderFor(t);
    const meshes = kExamples ? [join(kExamples, "clownfish.obj"), join(kExamples, "whale.obj")] : [join(kRoot, "data/sphere_uv.obj"), join(kRoot, "data/cloud_base.obj")];
    const program = await startProgram(t, [...meshes, "--quality", kExamples ? "balanced" : "fast"], folder);
    const look = await LookPage.open(t, browser, program.address, { width: 1200, height: 700 });
    assert.equal(await look.value("#what"), "transfer");
    const before = await look.small();
    await look.screenshot("transfer");
    const { x, y } = await look.middle("#picture");
    // Half a turn: each still stands where it stood.
    const { width } = await look.middle("#picture");
    await look.drag({ x: x - width / 4, y }, { x: x + width / 4, y });
    await look.finished();
    assert.ok(difference(before, await look.small()) > 1);
    const [[left], [right]] = [await look.mean(0.1, 0.45), await look.mean(0.55, 0.9)];
    const [ground] = await look.mean(0.49, 0.51);
    assert.ok(left < ground - 3 && right < ground - 3, `${[left, ground, right]}`);
    await look.tab.select("#transfer-preview-paint", "distortion");
    await look.finished();
    await look.screenshot("distortion");
  });

  test("wisps come with their look", kLimit, async (t) => {
    const folder = folderFor(t);
    const program = await startProgram(t, kSmall, folder);
    const look = await LookPage.open(t, browser, program.address);
    await look.tab.click("#open-looks");
    await look.tab.waitForFunction(() => document.querySelector("[data-look=wisps] img")?.naturalWidth === 240);
    await look.screenshot("looks_wisps");
    await look.tab.click("[data-look=wisps]");
    await look.tab.waitForFunction(() => document.getElementById("what").value === "wisps");
    await look.type("#wisps-dots", "3000");
    await look.type("#wisps-resolution", "48");
    await look.finished();
    assert.equal((await look.settings()).settings.render.phase, "mie:8");
    await look.screenshot("wisps");
  });
});

describe("an export", () => {
  test("is stopped by its button and leaves nothing", kLimit, async (t) => {
    const { look, folder } = await cloud(t);
    const before = readdirSync(folder).sort();
    await look.type("#cloud-resolution", "160");
    await look.finished();
    await look.tab.click("#open-out");
    await look.tab.click("[data-job-of=turntable]");
    await look.tab.waitForSelector(".job[data-state=running] button");
    await look.tab.click(".job[data-state=running] button");
    await look.says(".job[data-state=stopped]", /Stopped/);
    assert.deepEqual(readdirSync(folder).sort(), before);
  });
});

describe("a script", () => {
  const kScript = `param float size = 1 in [0.3, 2] "radius of the ball";
scalarfield density = mask(sphere((0, 0, 0), size) + 0.2 * perlin(3, 1), 0.1);
`;

  test("has its parameters; a bad save shows its message over the last picture", kLimit, async (t) => {
    const folder = folderFor(t);
    const path = join(folder, "ball.felt");
    writeFileSync(path, kScript);
    const program = await startProgram(t, ["ball.felt", "--quality", "draft"], folder);
    const look = await LookPage.open(t, browser, program.address);
    await look.type("#parameters-size", "5");
    await look.says("#banner", /may be from 0.3 to 2/);
    await new Promise((done) => setTimeout(done, 500));
    assert.match(await look.text("#banner"), /may be from 0.3 to 2/);
    await look.type("#parameters-size", "0.5");
    await look.finished();
    const good = await look.small();
    writeFileSync(path, kScript.replace("sphere(", "spere("));
    await look.says("#banner", /spere/);
    assert.ok(difference(good, await look.small()) < kSame);
    await look.screenshot("bad_save");
    writeFileSync(path, kScript.replace("0.2 *", "0.7 *"));
    await look.tab.waitForFunction(() => document.getElementById("banner").hidden);
    await look.settings();
    await look.finished();
    assert.equal(await look.value("#parameters-size"), "0.5");
    assert.ok(difference(good, await look.small()) > 1);
  });
});

describe("the program", () => {
  test("is away for a moment, then back; then it ends", kLimit, async (t) => {
    const folder = folderFor(t);
    const program = await startCloud(t, folder);
    const wire = await startWire(t, program.address);
    const look = await LookPage.open(t, browser, wire.address);
    const before = await look.small();
    wire.cut(true);
    await look.says("#banner", /lost/);
    assert.ok(difference(before, await look.small()) < kSame);
    await look.screenshot("lost");
    await look.type("#render-exposure", "2");
    wire.cut(false);
    await look.tab.waitForFunction(() => document.getElementById("banner").hidden);
    await look.settings();
    await look.finished();
    assert.ok(difference(before, await look.small()) > kSame);
    await program.stop();
    await look.says("#banner", /ended|lost/);
  });
});
