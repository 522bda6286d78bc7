// Both engines are made of the same versions of their dependencies: equal bits are no accident.
import { expect, test } from "vitest";
import { text } from "./files";

function packages(path: string): Map<string, string[]> {
  const found = new Map<string, string[]>();
  for (const [, name = "", version = ""] of text(path).matchAll(/name = "(.*)"\nversion = "(.*)"/g)) {
    found.set(name, [...(found.get(name) ?? []), version]);
  }
  return found;
}

test("skate-web has the versions of the workspace", () => {
  const [native, web] = [packages("Cargo.lock"), packages("rust/skate-web/Cargo.lock")];
  web.delete("skate-web");
  for (const [name, versions] of web) {
    for (const version of versions) expect(native.get(name) ?? [], name).toContain(version);
  }
});
