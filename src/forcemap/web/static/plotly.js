// The script that draws charts, from the installed plotly package; the page is there before it.

let loading = null;

export function plotly() {
  loading ??= new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = "/plotly.min.js";
    script.onload = () => resolve(window.Plotly);
    script.onerror = () => reject(new Error("the script of plotly did not arrive"));
    document.head.append(script);
  });
  return loading;
}
