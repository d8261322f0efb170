
"use strict";
document.documentElement.classList.add("js");
addEventListener("DOMContentLoaded", () => {
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];
  const one = (selector, root = document) => root.querySelector(selector);
  const button = (className, parent) => {
    const made = document.createElement("button");
    made.type = "button";
    made.className = className;
    made.append(...parent.childNodes);
    parent.append(made);
    return made;
  };

  // Theme: the system's until the button is used.
  const theme = one("#theme");
  const system = matchMedia("(prefers-color-scheme: dark)");
  let dark = system.matches;
  const paint = () => { theme.textContent = dark ? "Light" : "Dark"; };
  system.addEventListener("change", () => { dark = system.matches; document.documentElement.style.colorScheme = ""; paint(); });
  theme.addEventListener("click", () => { dark = !dark; document.documentElement.style.colorScheme = dark ? "dark" : "light"; paint(); });
  theme.hidden = false;
  paint();

  // What a table sorts, filters and opens: its rows or, where each has details below it, its bodies.
  const items = (table) => table.classList.contains("groups") ? [...table.tBodies] : [...table.tBodies[0].rows];

  // Sorting: a head tells what its column holds, and a cell its value where that is not its text. No value comes last.
  for (const table of all("table.sorts")) {
    const own = items(table);
    const place = new Map(own.map((item, i) => [item, i]));
    const heads = all("th[data-sort]", table.tHead);
    const sort = (head) => {
      const kind = head.dataset.sort, now = head.getAttribute("aria-sort");
      const up = now ? now !== "ascending" : kind !== "down";
      const value = (item) => {
        const cell = (item.rows ? item.rows[0] : item).cells[head.cellIndex];
        return cell.dataset.value ?? cell.textContent.trim();
      };
      const compare = kind === "text" ? (a, b) => a.localeCompare(b) : (a, b) => a - b;
      own.sort((a, b) => {
        const [one, other] = [value(a), value(b)];
        return (one === "") - (other === "") || (up ? 1 : -1) * compare(one, other) || place.get(a) - place.get(b);
      });
      (table.classList.contains("groups") ? table : table.tBodies[0]).append(...own);
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
    };
    for (const head of heads) button("", head).addEventListener("click", () => sort(head));
  }

  // Details: the first cell of a body opens the rows below it.
  const open = (body, yes) => {
    body.classList.toggle("open", yes);
    one(".opens", body).setAttribute("aria-expanded", yes);
  };
  for (const body of all("table.groups > tbody")) {
    button("opens", one("th", body)).addEventListener("click", () => open(body, !body.classList.contains("open")));
    open(body, false);
  }

  // Filters: every word, anywhere in a row; and one of its kinds.
  for (const form of all("form.filter")) {
    const own = items(document.getElementById(form.dataset.table));
    const { words, kind } = form.elements;
    const filter = () => {
      const wanted = words.value.toLowerCase().split(/\s+/);
      const fits = (item) => {
        const text = (item.dataset.words ?? item.textContent).toLowerCase();
        return (!kind?.value || item.dataset.kind.split(" ").includes(kind.value)) && wanted.every((word) => text.includes(word));
      };
      let shown = 0;
      for (const item of own) shown += !item.classList.toggle("out", !fits(item));
      one("output", form).textContent = `${shown} of ${own.length} shown`;
    };
    form.addEventListener("input", filter);
    form.addEventListener("submit", (event) => event.preventDefault());
    form.hidden = false;
    filter();
  }

  // A link to a body of a table opens it, and shows what a filter hides.
  for (const link of all("a[href^='#']")) {
    link.addEventListener("click", (event) => {
      const body = document.getElementById(link.hash.slice(1));
      if (!body?.matches("table.groups > tbody")) return;
      event.preventDefault();
      const form = all("form.filter").find((form) => form.dataset.table === body.parentElement.id);
      form?.reset();
      form?.dispatchEvent(new Event("input"));
      open(body, true);
      body.scrollIntoView({ block: "center" });
      one(".opens", body).focus();
    });
  }

  // Frames: a dialog shows a copy, whose pictures are those of the page.
  const dialog = one("dialog");
  for (const button of all(".enlarge")) {
    button.hidden = false;
    one(".sides", button.parentElement).addEventListener("click", () => button.click());
    button.addEventListener("click", () => {
      const copies = all("h3, .sides, .bar", button.parentElement).map((node) => node.cloneNode(true));
      for (const node of copies) all("[id]", node).forEach((item) => item.removeAttribute("id"));
      one("div", dialog).replaceChildren(...copies);
      dialog.showModal();
    });
  }
  one("button", dialog).addEventListener("click", () => dialog.close());

  // Commands name the folder that a page lies in as DATASET: the page knows it once it is opened from there.
  const folder = location.protocol === "file:" && decodeURIComponent(location.pathname).replace(/\/[^/]*$/, "");
  if (folder && /^[\w./-]+$/.test(folder)) for (const code of all(".command")) code.textContent = code.textContent.replace(" DATASET ", ` ${folder} `);

  // Paper shows what is folded away.
  let folded = [];
  addEventListener("beforeprint", () => { folded = all("details:not([open])"); for (const each of folded) each.open = true; });
  addEventListener("afterprint", () => { for (const each of folded) each.open = false; });
});
