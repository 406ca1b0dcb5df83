// The index: sorting, filtering, two side by side.
"use strict";
(() => {
  document.documentElement.classList.add("script");
  const body = document.querySelector("#diagnoses tbody"), rows = [...body.rows];
  const find = document.getElementById("find"), verdict = document.getElementById("verdict");
  const shown = document.getElementById("shown"), beside = document.getElementById("beside");
  const texts = new Map(rows.map((row) => [row, row.textContent.toLowerCase()]));
  const filter = () => {
    const words = find.value.toLowerCase().split(/\s+/).filter(Boolean);
    let n = 0;
    rows.forEach((row) => {
      row.hidden = !words.every((word) => texts.get(row).includes(word)) || (verdict.value && row.dataset.verdict !== verdict.value);
      if (!row.hidden) n++;
    });
    shown.textContent = n + " of " + rows.length + " shown";
  };
  find.addEventListener("input", filter);
  verdict.addEventListener("change", filter);
  const heads = [...document.querySelectorAll("#diagnoses thead button")];
  heads.forEach((button) => button.addEventListener("click", () => {
    const head = button.closest("th"), up = head.getAttribute("aria-sort") !== "ascending", column = Number(button.dataset.column);
    heads.forEach((other) => other.closest("th").removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", up ? "ascending" : "descending");
    const numbers = head.classList.contains("number");
    const value = (row) => row.cells[column + 1].dataset.sort;
    rows.sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      // What has no figure stands last either way.
      if ((x === "") !== (y === "")) return x === "" ? 1 : -1;
      const order = numbers ? x - y : x.localeCompare(y, undefined, { numeric: true });
      return up ? order : -order;
    });
    body.append(...rows);
  }));
  let ticked = [];
  rows.forEach((row) => row.querySelector("input").addEventListener("change", (event) => {
    ticked = event.target.checked ? [...ticked, row] : ticked.filter((other) => other !== row);
    while (ticked.length > 2) ticked.shift().querySelector("input").checked = false;
    beside.replaceChildren(...(ticked.length < 2 ? [] : ticked.map((one) => {
      const card = document.getElementById(one.dataset.card).cloneNode(true);
      card.removeAttribute("id");
      return card;
    })));
    // They stand above the table, and the second tick may be far down.
    if (ticked.length === 2) beside.scrollIntoView({ block: "start" });
  }));
  filter();
})();
