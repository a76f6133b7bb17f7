import "./theme.js";
import { Link } from "./link.js";
import { speak } from "./words.js";
await speak();
const out = document.getElementById("numbers");
const seen = {};
const show = () => { out.textContent = JSON.stringify(seen, null, 1); };
const link = new Link({ hello: (m) => { seen.hello = m; }, frame: (m) => { seen.frame = m; show(); }, state: (m) => { seen.state = m; show(); } });
