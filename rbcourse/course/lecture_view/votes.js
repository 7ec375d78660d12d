"use strict";

// V opens the vote on the poll that was reached last, and closes it.
window.vote = (() => {
  const panel = document.querySelector("#lecture-vote").content.firstElementChild;
  let state = { poll: "", open: false, voters: 0, counts: [] };

  const words = () => {
    const votes = state.voters === 1 ? "1 vote" : `${state.voters} votes`;
    if (!state.poll) return "V opens the vote on a poll.";
    return `${state.poll}: ${votes}${state.open ? "; V closes the vote" : ""}`;
  };

  // The options of a poll are the items of its list that begin with a letter in bold.
  const findOptions = (poll) => {
    const cell = poll?.closest(".jp-Cell");
    return [...(cell?.querySelectorAll("li") ?? [])].filter((item) =>
      /^[A-Z]$/.test(item.querySelector("strong")?.textContent),
    );
  };

  const show = () => {
    panel.remove();
    const poll = [...document.querySelectorAll("#rendered_cells h3")].find(
      (heading) => heading.innerText.trim() === state.poll,
    );
    if (!poll) return;
    panel.querySelector("output").textContent = state.voters === 1 ? "1 vote" : `${state.voters} votes`;
    if (state.open) poll.closest(".jp-Cell").prepend(panel);
    const options = findOptions(poll), most = Math.max(1, ...state.counts);
    options.forEach((option, i) => {
      option.classList.toggle("lecture-counted", !state.open);
      option.dataset.count = state.counts[i] ?? "";
      option.style.setProperty("--share", `${(100 * (state.counts[i] ?? 0)) / most}%`);
    });
  };

  const ask = async (body) => {
    const settings = body && { method: "POST", body: JSON.stringify(body) };
    const answer = await fetch(`votes${location.search}`, settings);
    if (!answer.ok) throw new Error(`The vote: ${(await answer.json()).message}`);
    state = await answer.json();
    show();
  };

  const turn = () => {
    const { poll, name } = window.lecture.tell();
    if (state.open) ask({});
    else if (poll) ask({ poll: name, options: findOptions(poll).length });
  };

  window.addEventListener("load", () => ask());
  setInterval(() => state.open && ask(), 1000);
  return { turn, words };
})();
