"use strict";

// Every table can be sorted by a click on a head, within its groups, and searched; the names of its rows stay in view.
// A row that is not found is "unfound", whatever else hides it.

const NUMBER = /^[>×+\s]*([-−+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)/;
const FEWEST_TO_SEARCH = 9; // rows

function groupsOf(table) {
  return [...table.tBodies].map((body) => {
    const rows = [...body.rows];
    const head = rows.find((row) => row.classList.contains("group"));
    return { body, head, rows: rows.filter((row) => row !== head) };
  });
}

// Hides the heads of groups without a row that is seen; returns how many rows are seen, and how many there are.
function countRows(table) {
  let [seen, all] = [0, 0];
  for (const { head, rows } of groupsOf(table)) {
    const shown = rows.filter((row) => !row.hidden && !row.classList.contains("unfound")).length;
    if (head) head.hidden = shown === 0;
    seen += shown;
    all += rows.length;
  }
  return [seen, all];
}

function makeSortable(table) {
  const groups = groupsOf(table);
  const labels = Number(table.dataset.labels);
  const heads = [...table.tHead.rows[0].cells];
  const valueOf = (row, column) => {
    const text = row.cells[column].textContent.trim();
    const found = NUMBER.exec(text);
    return column >= labels && found ? Number(found[1].replace("−", "-")) : text;
  };
  const isNone = (value) => value === "" || value === "–";
  function compare(a, b) {
    if (isNone(a) || isNone(b)) return isNone(a) - isNone(b); // What is missing comes last, whatever the direction.
    if (typeof a === "number" && typeof b === "number") return a - b;
    if (typeof a !== typeof b) return typeof a === "number" ? -1 : 1;
    return a.localeCompare(b, "en", { numeric: true });
  }
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    // Numbers fall first, names rise; the third click brings the order of the page back.
    const directions = column < labels ? ["ascending", "descending"] : ["descending", "ascending"];
    button.addEventListener("click", () => {
      const direction = directions[directions.indexOf(head.getAttribute("aria-sort")) + 1];
      for (const other of heads) other.removeAttribute("aria-sort");
      if (direction) head.setAttribute("aria-sort", direction);
      for (const { body, rows } of groups) {
        const ordered = rows.map((row) => ({ row, value: valueOf(row, column) }));
        if (direction) {
          const sign = direction === "ascending" ? 1 : -1;
          ordered.sort((a, b) => {
            const order = compare(a.value, b.value);
            return isNone(a.value) || isNone(b.value) ? order : sign * order;
          });
        }
        body.append(...ordered.map(({ row }) => row));
      }
    });
  });
}

function makeSearchable(table) {
  const groups = groupsOf(table);
  const rows = groups.flatMap((group) => group.rows);
  if (rows.length < FEWEST_TO_SEARCH) return;
  const line = document.createElement("p");
  line.className = "filters search";
  const label = line.appendChild(document.createElement("label"));
  const input = document.createElement("input");
  input.type = "search";
  label.append("Find rows ", input);
  const count = line.appendChild(document.createElement("span"));
  count.setAttribute("aria-live", "polite");
  (table.closest(".scroll") || table).before(line);
  input.addEventListener("input", () => {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    for (const { head, rows: ofGroup } of groups) {
      const title = head ? head.textContent : "";
      for (const row of ofGroup) {
        const text = `${title} ${row.textContent}`.toLowerCase();
        row.classList.toggle("unfound", !words.every((word) => text.includes(word)));
      }
    }
    const [seen, all] = countRows(table);
    count.textContent = words.length ? `${seen} of ${all} rows` : "";
    table.dispatchEvent(new Event("searched"));
  });
}

// The columns of names stay at the left as far as they take no more than half of what is seen.
function keepNames(table) {
  const box = table.closest(".scroll");
  const cells = [...table.tHead.rows[0].cells].slice(0, Number(table.dataset.labels));
  let [left, kept] = [0, 0];
  for (const cell of cells) {
    if (kept > 0 && (kept === 3 || left + cell.offsetWidth > box.clientWidth / 2)) break;
    table.style.setProperty(`--left-${kept}`, `${left}px`);
    left += cell.offsetWidth;
    kept += 1;
  }
  table.dataset.kept = kept;
  table.style.setProperty("--head", `${table.tHead.offsetHeight}px`);
}

document.addEventListener("DOMContentLoaded", () => {
  const observer = new ResizeObserver((entries) => {
    for (const { target } of entries) keepNames(target.querySelector("table.results"));
  });
  for (const table of document.querySelectorAll("table.results")) {
    makeSortable(table);
    makeSearchable(table);
    observer.observe(table.closest(".scroll"));
  }
});
