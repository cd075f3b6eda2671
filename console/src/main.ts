import { mount } from "svelte";

import App from "./App.svelte";
import "./app.css";
import { claimProof } from "./gateway.ts";

const target = document.getElementById("app");
if (!target) throw new Error("The page has no place for the console.");
const begin = (): void => {
  mount(App, { target });
};
// Without an answer the page says that it is signed out, and how to go on.
void claimProof().then(begin, begin);
