// The program under test, and a browser to look at its page.
import { spawn } from "node:child_process";
import { once } from "node:events";
import { existsSync, mkdirSync, mkdtempSync, rmSync } from "node:fs";
import { createServer, connect } from "node:net";
import { tmpdir } from "node:os";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import puppeteer from "puppeteer-core";

export const kRoot = resolve(dirname(fileURLToPath(import.meta.url)), "../..");
/** BROWSER=firefox tests with Firefox, which tells nothing of phones and colour schemes. */
export const isFirefox = process.env.BROWSER === "firefox";
export const kShots = join(kRoot, "build/look-screenshots", isFirefox ? "firefox" : "");
const kProgram = resolve(process.env.NEPHELE ?? join(kRoot, "build/bin/nephele"));
const kBrowsers = isFirefox
  ? [process.env.FIREFOX, "/usr/bin/firefox-esr", "/usr/bin/firefox"]
  : [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/google-chrome"];

/** A cloud that is made in a moment. For pictures in docs/, RESOLUTION=256 makes a finer one. */
export const kSmall = ["--resolution", process.env.RESOLUTION ?? "40", "--layers", process.env.RESOLUTION ? "4" : "2", "--quality", process.env.RESOLUTION ? "good" : "draft"];

/** A folder for a test, removed when it ends. */
export function folderFor(test) {
  const folder = mkdtempSync(join(tmpdir(), "nephele-look-"));
  test.after(() => rmSync(folder, { recursive: true, force: true }));
  return folder;
}

/** Starts `nephele look` with these arguments in `folder`; its address, and how it is stopped. */
export async function startProgram(test, args, folder) {
  const child = spawn(kProgram, ["look", "--no-browser", "--port", "8700", ...args], {
    cwd: folder,
    env: { ...process.env, XDG_CONFIG_HOME: join(folder, "config") },
    stdio: ["ignore", "pipe", "pipe"],
  });
  let said = "";
  const address = await new Promise((found, failed) => {
    const read = (bytes) => {
      said += bytes;
      const line = /http:\/\/\S+/.exec(said);
      if (line) found(line[0]);
    };
    child.stdout.on("data", read);
    child.stderr.on("data", read);
    child.on("error", failed);
    child.on("exit", (code) => failed(new Error(`nephele look ended with ${code}: ${said}`)));
  });
  const stop = async () => {
    if (child.exitCode !== null || child.signalCode !== null) return;
    child.kill("SIGINT");
    await once(child, "exit");
  };
  test.after(stop);
  return { address, stop, child };
}

/** Passes connections on to the program, so that they can be cut. */
export async function startWire(test, address) {
  const { hostname, port, pathname } = new URL(address);
  const sockets = new Set();
  let isCut = false;
  const server = createServer((near) => {
    if (isCut) return near.destroy();
    const far = connect(Number(port), hostname);
    for (const [one, other] of [[near, far], [far, near]]) {
      sockets.add(one);
      one.pipe(other);
      one.on("error", () => other.destroy());
      one.on("close", () => {
        sockets.delete(one);
        other.destroy();
      });
    }
  });
  server.listen(0, "127.0.0.1");
  await once(server, "listening");
  const cut = (isOn) => {
    isCut = isOn;
    if (isOn) for (const socket of sockets) socket.destroy();
  };
  test.after(() => {
    cut(true);
    server.close();
  });
  return { address: `http://127.0.0.1:${server.address().port}${pathname}`, cut };
}

export async function startBrowser() {
  const executablePath = kBrowsers.find((path) => path && existsSync(path));
  if (!executablePath) throw new Error(`there is no ${isFirefox ? "Firefox; FIREFOX" : "chromium; CHROMIUM"}=FILE names one`);
  mkdirSync(kShots, { recursive: true });
  if (isFirefox) return puppeteer.launch({ browser: "firefox", executablePath, headless: true });
  return puppeteer.launch({ executablePath, headless: true, args: ["--no-sandbox", "--disable-dev-shm-usage"] });
}
