import { mount } from "svelte";

import App from "./App.svelte";
import "./app.css";
import { type Extension, extensions } from "./extensions.ts";
import { claimProof } from "./gateway.ts";

const found = import.meta.glob<Extension>("./extensions/*/extension.ts", { eager: true, import: "extension" });
extensions.push(...Object.values(found));

const target = document.getElementById("app");
if (!target) throw new Error("The page has no place for the console.");
const begin = (): void => {
  mount(App, { target });
};
// Without an answer the page says that it is signed out, and how to go on.
void claimProof().then(begin, begin);
