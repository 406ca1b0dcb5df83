// The filter by joint, the copy button, and hints beside what scrolls.
"use strict";
const data = JSON.parse(document.getElementById("packet").textContent);
const unpack = (row, step) => {
  let sum = 0;
  return row.map((difference) => difference == null ? null : (sum += difference) * step);
};
document.documentElement.classList.add("script");
let picked = null;
const pick = (joint) => {
  picked = joint === picked ? null : joint;
  document.querySelectorAll("[data-joints]").forEach((row) => {
    const names = JSON.parse(row.dataset.joints);
    row.classList.toggle("filtered", picked !== null && names.length > 0 && !names.includes(picked));
  });
  document.querySelectorAll("[data-pick]").forEach((chip) => {
    chip.toggleAttribute("aria-current", chip.dataset.pick === picked);
  });
  const labels = document.querySelectorAll("#skeleton .labels text");
  document.querySelectorAll("#skeleton .joint").forEach((group, j) => {
    group.classList.toggle("picked", group.dataset.joint === picked);
    labels[j].classList.toggle("picked", group.dataset.joint === picked);
    group.setAttribute("aria-pressed", String(group.dataset.joint === picked));
  });
  const note = document.getElementById("filter");
  note.hidden = picked === null;
  note.querySelector("b").textContent = picked ?? "";
  if (picked !== null) show(picked);
};
document.querySelectorAll("[data-pick]").forEach((chip) => chip.addEventListener("click", (event) => {
  event.preventDefault();
  pick(chip.dataset.pick);
}));
document.querySelector("#filter button").addEventListener("click", () => pick(picked));
document.querySelectorAll("[data-copy]").forEach((button) => button.addEventListener("click", async () => {
  const source = document.getElementById(button.dataset.copy);
  try {
    await navigator.clipboard.writeText(source.textContent);
    button.textContent = "Copied";
  } catch {
    // A page from a folder may not write to the clipboard: the text is selected instead.
    getSelection().selectAllChildren(source);
    button.textContent = "Selected: press Ctrl+C";
  }
}));
// The link of the section in sight stands out, and stays in sight itself.
const links = new Map([...document.querySelectorAll(".contents a")].map((link) => [link.hash.slice(1), link]));
const inSight = new Set();
const watch = new IntersectionObserver((entries) => {
  entries.forEach(({ target, isIntersecting }) => { isIntersecting ? inSight.add(target.id) : inSight.delete(target.id); });
  const first = [...links.keys()].find((id) => inSight.has(id));
  links.forEach((link, id) => link.toggleAttribute("aria-current", id === first));
  const link = links.get(first), bar = link?.parentElement;
  if (bar) bar.scrollLeft = link.offsetLeft - 0.5 * (bar.clientWidth - link.offsetWidth);
}, { rootMargin: "-15% 0px -70% 0px" });
document.querySelectorAll("main > section").forEach((section) => watch.observe(section));
const wide = ".scroll, .contents";
const hint = () => document.querySelectorAll(wide).forEach((box) => {
  box.classList.toggle("more", box.scrollWidth > box.clientWidth + 2 && box.scrollLeft + box.clientWidth < box.scrollWidth - 2);
});
document.querySelectorAll(wide).forEach((box) => box.addEventListener("scroll", hint, { passive: true }));
addEventListener("resize", hint);
document.querySelectorAll("details").forEach((box) => box.addEventListener("toggle", hint));
hint();
