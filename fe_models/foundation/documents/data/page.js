"use strict";
// The contents bar: the section that is read is marked.
(function () {
  const links = new Map([...document.querySelectorAll("nav a")].map((a) => [a.hash.slice(1), a]));
  const sections = [...document.querySelectorAll("section[id]")].filter((section) => links.has(section.id));
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
