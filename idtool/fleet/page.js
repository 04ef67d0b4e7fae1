// The table of sessions a page at a time, and only what is searched for; without it all of them show.
const PER_PAGE = 100;
const section = document.getElementById("sessions"), pager = section.querySelector(".pager");
const rows = [...section.querySelectorAll("tbody tr")];
const words = rows.map(row => (row.textContent + ("failed" in row.dataset ? " failed" : "")).toLowerCase());
const [earlier, later] = pager.querySelectorAll("button");
let page = 0;
function show() {
  const wanted = pager.querySelector("input").value.toLowerCase().split(/\s+/);
  const found = rows.filter((_, k) => wanted.every(word => words[k].includes(word)));
  const last = Math.max(Math.ceil(found.length / PER_PAGE) - 1, 0);
  page = Math.min(Math.max(page, 0), last);
  const shown = new Set(found.slice(page * PER_PAGE, (page + 1) * PER_PAGE));
  for (const row of rows) row.hidden = !shown.has(row);
  const first = page * PER_PAGE;
  pager.querySelector("span").textContent =
    found.length ? `${first + 1} to ${first + shown.size} of ${found.length}` : "none";
  earlier.disabled = page === 0;
  later.disabled = page === last;
}
pager.querySelector("input").addEventListener("input", () => { page = 0; show(); });
earlier.addEventListener("click", () => { page -= 1; show(); });
later.addEventListener("click", () => { page += 1; show(); });
if (rows.length > PER_PAGE) { pager.hidden = false; show(); }
