// Where a page asks for the body area, choosing one answers at once; with the keyboard it is walked through first.
let keyed = false;

document.addEventListener("keydown", (event) => (keyed = event.key !== "Enter"));
document.addEventListener("pointerdown", () => (keyed = false));
document.addEventListener("change", (event) => {
  const form = event.target.closest(".area-asked");
  if (form && !keyed) form.requestSubmit();
});
