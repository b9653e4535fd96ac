// A place where files are dropped: what is dropped beside it does not replace the page.
export function dropZone(zone, take) {
  for (const name of ["dragenter", "dragover"])
    zone.addEventListener(name, (event) => {
      event.preventDefault();
      zone.classList.add("over");
    });
  for (const name of ["dragleave", "drop"]) zone.addEventListener(name, () => zone.classList.remove("over"));
  zone.addEventListener("drop", (event) => {
    event.preventDefault();
    take(event.dataTransfer.files);
  });
  for (const name of ["dragover", "drop"]) addEventListener(name, (event) => event.preventDefault());
}
