//! Doc comments as words on a page: code in them is how the sources write symbols.

/// The words of a doc comment as they stand on a page.
pub fn spelled(text: &str) -> String {
    let mut line: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    // What links lead to in rustdoc is not on the page.
    for link in ["[`LoadCurve`]", "[`balance_load_ratio`]", "[`screened_load_ratio`]"] {
        line = line.replace(link, "the [load in time](model.md#the-load-in-time)");
    }
    const SYMBOLS: [(&str, &str); 20] = [
        ("`F_T / F_N`", "F_T/F_N"),
        ("`L_p / L`", "L_p/L"),
        ("`L_p = L`", "L_p = L"),
        ("`mu_s / mu_d`", "μ_s/μ_d"),
        ("`mu_d`", "μ_d"),
        ("`mu_s`", "μ_s"),
        ("`mu_s F_N`", "μ_s F_N"),
        ("`mu_d F_N`", "μ_d F_N"),
        ("`mu_s p_n`", "μ_s p_n"),
        ("`mu_d p_n`", "μ_d p_n"),
        ("`f_0 F_N`", "f_0 F_N"),
        ("`f_0 p_n`", "f_0 p_n"),
        ("`tau / p`", "τ/p"),
        ("`tau_n / p_n`", "τ_n/p_n"),
        ("`tau_n`", "τ_n"),
        ("`tau`", "τ"),
        ("`alpha = (mu_s + mu_d) / 2`", "α = (μ_s + μ_d)/2"),
        ("`alpha`", "α"),
        ("`2 tau / gamma`", "2τ/γ"),
        ("`F_N`", "F_N"),
    ];
    for (written, printed) in SYMBOLS {
        line = line.replace(written, printed);
    }
    line.replace("`F_T`", "F_T").replace("`p`", "p")
}
