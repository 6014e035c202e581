import { mount } from "svelte";
import "./style.css";
import App from "./App.svelte";
import { takeTokenFromAddress } from "./api/token";
import { preferredLanguage, texts } from "./texts/texts.svelte";

takeTokenFromAddress();
await texts.load(preferredLanguage());
const target = document.getElementById("page");
if (target === null) throw new Error("no element to put the page into");
mount(App, { target });
