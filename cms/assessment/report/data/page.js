"use strict";
// Charts, the contents bar and the switch of the horizontal axis. The data stand in the page as JSON.
(function () {
  const charts = JSON.parse(document.getElementById("charts").textContent);
  const options = {
    displaylogo: false, responsive: true,
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d", "toggleSpikelines", "hoverClosestCartesian", "hoverCompareCartesian"],
    toImageButtonOptions: { format: "svg" },
  };
  const drawn = [];
  for (const box of document.querySelectorAll(".chart")) {
    const chart = charts[box.id];
    if (chart) {
      drawn.push(box);
      Plotly.newPlot(box, chart.data, chart.layout, options);
    }
  }

  // number of modes or of coordinates across
  const words = ["vibration modes", "generalised coordinates"];
  for (const button of document.querySelectorAll(".switch button")) {
    button.addEventListener("click", () => {
      const column = Number(button.dataset.column);
      for (const other of button.parentElement.children) {
        other.setAttribute("aria-pressed", String(other === button));
      }
      for (const box of document.querySelectorAll(".chart.convergence")) {
        const x = box.data.map((trace) => trace.customdata.map((row) => row[column]));
        Plotly.update(box, { x: x }, { "xaxis.title.text": words[column] });
      }
    });
  }

  // paper is narrower than the screen
  window.addEventListener("beforeprint", () => {
    for (const box of drawn) {
      const width = box.closest(".grid.three") ? 218 : box.closest(".grid") ? 332 : 695;  // 184 mm, gaps as in page.css
      Plotly.relayout(box, { width: width });
    }
  });
  window.addEventListener("afterprint", () => {
    for (const box of drawn) {
      Plotly.relayout(box, { width: null, autosize: true });
    }
  });

  const links = new Map([...document.querySelectorAll("nav a")].map((a) => [a.hash.slice(1), a]));
  const sections = [...document.querySelectorAll("section[id]")];
  function mark() {
    const line = window.innerHeight * 0.3;
    const atEnd = window.innerHeight + window.scrollY >= document.body.scrollHeight - 4;
    let here = sections[0];
    for (const section of sections) {
      if (section.getBoundingClientRect().top <= line) here = section;
    }
    if (atEnd) here = sections[sections.length - 1];
    for (const [id, link] of links) link.classList.toggle("here", here !== undefined && id === here.id);
  }
  window.addEventListener("scroll", mark, { passive: true });
  mark();
  document.body.dataset.ready = "charts";
})();
