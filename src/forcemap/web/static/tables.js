// Tables that are sorted by their heads, searched, and filtered by what stands in a column.
// A table [data-sorted] has its tools in front of it: input[type=search], select[data-column], and .shown for the count.
// A long one is shown page by page, so that nobody has to tab through thousands of rows to what stands below it.

const ROWS = 100; // of a page

export function tables(root) {
  for (const table of root.querySelectorAll("table[data-sorted]")) if (!table.dataset.ready) ready(table);
}

function ready(table) {
  table.dataset.ready = "yes";
  const tools = table.closest(".listed")?.querySelector(".tools");
  const rows = [...table.tBodies[0].rows];
  const texts = new Map(rows.map((row) => [row, row.textContent.toLowerCase()]));
  const [search, filter, shown] = ["input[type=search]", "select[data-column]", ".shown"].map((part) => tools?.querySelector(part));

  const pages = Object.assign(document.createElement("div"), { className: "pages" });
  const [before, place, next] = ["button", "span", "button"].map((tag) => pages.appendChild(document.createElement(tag)));
  let first = 0;

  for (const [button, words, step] of [[before, "Rows before", -ROWS], [next, "Next rows", ROWS]]) {
    Object.assign(button, { type: "button", className: "plain", textContent: words });
    button.addEventListener("click", () => {
      show(first + step);
      table.scrollIntoView({ block: "start" });
      if (button.disabled) (step > 0 ? before : next).focus();
    });
  }

  function value(row, column) {
    const text = row.cells[column].dataset.value ?? row.cells[column].textContent.trim();
    const number = Number.parseFloat(text);
    return text === "" || text === "-" ? null : Number.isFinite(number) && /^[\d.+-]/.test(text) ? number : text.toLowerCase();
  }

  function sort(head, column) {
    const down = head.getAttribute("aria-sort") === "ascending";
    for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const sign = down ? -1 : 1;
    const keyed = [...table.tBodies[0].rows].map((row) => [value(row, column), row]);
    keyed.sort(([a], [b]) => {
      if (a === null || b === null) return (a === null) - (b === null); // what is not known stands last
      if (typeof a !== typeof b) return sign * (typeof a === "number" ? -1 : 1);
      return sign * (a < b ? -1 : a > b ? 1 : 0);
    });
    table.tBodies[0].append(...keyed.map(([, row]) => row));
    show(0);
  }

  // the rows that fit, from this one on, in the order in which they stand
  function show(from) {
    first = from;
    const wanted = (search?.value ?? "").toLowerCase().split(/\s+/).filter(Boolean);
    const only = filter?.value ?? "";
    let count = 0;
    for (const row of table.tBodies[0].rows) {
      const fits = wanted.every((word) => texts.get(row).includes(word)) && (!only || row.cells[Number(filter.dataset.column)].textContent.trim() === only);
      row.hidden = !fits || count < first || count >= first + ROWS;
      count += fits;
    }
    if (shown) shown.textContent = `${count} of ${rows.length}`;
    pages.hidden = count <= ROWS;
    before.disabled = first === 0;
    next.disabled = first + ROWS >= count;
    place.textContent = `${first + 1} to ${Math.min(first + ROWS, count)} of ${count}`;
  }

  [...table.tHead.rows[0].cells].forEach((head, column) => {
    const button = Object.assign(document.createElement("button"), { type: "button" });
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => sort(head, column));
  });
  if (filter) for (const word of [...new Set(rows.map((row) => row.cells[Number(filter.dataset.column)].textContent.trim()))].sort()) filter.append(new Option(word || "(empty)", word));
  search?.addEventListener("input", () => show(0));
  filter?.addEventListener("input", () => show(0));
  if (tools) tools.hidden = false;
  table.closest(".wide")?.after(pages);
  show(0);
}
