
"use strict";
document.documentElement.classList.add("js");
addEventListener("DOMContentLoaded", () => {
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];
  const one = (selector, root = document) => root.querySelector(selector);

  // Theme: the system's until the button is used.
  const theme = one("#theme");
  const system = matchMedia("(prefers-color-scheme: dark)");
  let dark = system.matches;
  const paint = () => { theme.textContent = dark ? "Light" : "Dark"; };
  system.addEventListener("change", () => { dark = system.matches; document.documentElement.style.colorScheme = ""; paint(); });
  theme.addEventListener("click", () => { dark = !dark; document.documentElement.style.colorScheme = dark ? "dark" : "light"; paint(); });
  theme.hidden = false;
  paint();

  // Table of slices: each slice is a tbody of its row and its details.
  const table = one("table.slices");
  if (table) {
    const bodies = [...table.tBodies];
    const heads = all("th[data-key]", table.tHead);
    const open = (body, yes) => {
      body.classList.toggle("open", yes);
      one(".opens", body).setAttribute("aria-expanded", yes);
    };
    for (const body of bodies) {
      const head = one("th", body);
      const button = document.createElement("button");
      button.type = "button";
      button.className = "opens";
      button.append(...head.childNodes);
      button.setAttribute("aria-expanded", "false");
      button.addEventListener("click", () => open(body, !body.classList.contains("open")));
      head.append(button);
    }
    const sort = (head) => {
      const { key, numeric } = head.dataset;
      const up = head.getAttribute("aria-sort") ? head.getAttribute("aria-sort") !== "ascending" : key !== "size";
      const compare = numeric === undefined ? (a, b) => a.localeCompare(b) : (a, b) => a - b;
      bodies.sort((a, b) => (up ? 1 : -1) * compare(a.dataset[key], b.dataset[key]) || a.dataset.rank - b.dataset.rank);
      table.append(...bodies);
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
    };
    for (const head of heads) {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      button.addEventListener("click", () => sort(head));
      head.append(button);
    }

    const words = one("#filter"), kind = one("#kind"), count = one("#count");
    const changed = ["worse", "better"];
    const filter = () => {
      const wanted = words.value.toLowerCase().split(/\s+/);
      let shown = 0;
      for (const body of bodies) {
        const { slice, metric, kind: own } = body.dataset;
        const text = `${slice} ${metric}`.toLowerCase();
        const of_kind = !kind.value || (kind.value === "changed" ? changed.includes(own) : own === kind.value);
        const fits = of_kind && wanted.every((word) => text.includes(word));
        body.classList.toggle("out", !fits);
        shown += fits;
      }
      count.textContent = `${shown} of ${bodies.length} shown`;
    };
    words.addEventListener("input", filter);
    kind.addEventListener("change", filter);
    one(".filter").addEventListener("submit", (event) => event.preventDefault());
    one(".filter").hidden = false;
    filter();

    // A change's link opens its slice.
    for (const link of all("a[data-slice]")) {
      link.addEventListener("click", (event) => {
        const body = bodies.find((item) => item.dataset.slice === link.dataset.slice);
        if (!body) return;
        event.preventDefault();
        words.value = kind.value = "";
        filter();
        open(body, true);
        body.scrollIntoView({ block: "center" });
        one(".opens", body).focus();
      });
    }
  }

  // Frames: a dialog shows a copy, whose pictures are those of the page.
  const dialog = one("dialog");
  for (const button of all(".enlarge")) {
    button.hidden = false;
    one(".sides", button.parentElement).addEventListener("click", () => button.click());
    button.addEventListener("click", () => {
      const copies = ["h3", ".sides", ".bar"].map((name) => one(name, button.parentElement).cloneNode(true));
      for (const node of copies) all("[id]", node).forEach((item) => item.removeAttribute("id"));
      one("div", dialog).replaceChildren(...copies);
      dialog.showModal();
    });
  }
  if (dialog) one("button", dialog).addEventListener("click", () => dialog.close());
});
